"""What methods share that optimize the texture of one mesh: the texture, and the mesh that it belongs to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import torch

from mitex.asset import Asset
from mitex.atlas import PADDING, spread
from mitex.export.common import asset_from_textures
from mitex.geometry.conservative import cover
from mitex.geometry.raster import texel_space
from mitex.mesh import Mesh
from mitex.mesh.arrays import mesh_arrays, mesh_of_arrays
from mitex.methods.layout import check_mesh
from mitex.training import model_file


@dataclass(frozen=True, eq=False)
class MeshTexture:
    """A texture and its mesh; a method's own class names the method.

    Attributes:
        mesh: with the UVs of the texture.
        image: (R, R, 3) float32 sRGB in [0, 1], row 0 on top; anything where no face is.
        about: how it was made.
    """

    method: ClassVar[str]

    mesh: Mesh
    image: np.ndarray
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> Self:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        with model_file.opened(source, cls.method) as (tensors, about):
            return cls._of({key: tensor.numpy() for key, tensor in tensors.items()}, about)

    def save(self, path: str | Path) -> Path:
        """Writes mesh, texture and `about` as one safetensors file.

        Raises:
            OutputError: the place is not writable.
        """
        tensors = {name: torch.tensor(array) for name, array in self._arrays().items()}
        return model_file.save(path, tensors, self.method, {**self.about, "mesh": self.mesh.name})

    def apply(self, mesh: Mesh | None = None) -> Asset:
        """The mesh with its albedo texture.

        Args:
            mesh: the mesh that the texture was made for, if the caller wants that checked.

        Raises:
            ConfigError: it is another mesh: the texture belongs to the mesh it was optimized on.
        """
        check_mesh(mesh, self.mesh)
        surface = self.surface
        assert surface.uv is not None
        resolution = len(self.image)
        face, _ = cover(texel_space(surface.uv, resolution), resolution)
        used = (face >= 0).reshape(resolution, resolution)
        albedo = spread(self.image, used, PADDING)
        return asset_from_textures(surface, surface.uv, {"albedo": albedo}, surface.name)

    @property
    def surface(self) -> Mesh:
        """What the texture is put on."""
        return self.mesh

    @classmethod
    def _of(cls, arrays: Mapping[str, np.ndarray], about: Mapping[str, Any]) -> Self:
        """From the arrays of a model file."""
        mesh, image = mesh_of_arrays(arrays, str(about["mesh"])), arrays["image"].astype(np.float32)
        if image.ndim != 3 or image.shape[0] != image.shape[1] or image.shape[2] != 3:
            raise ValueError(f"an image of shape {image.shape}")
        if mesh.uv is None or not np.isfinite(image).all():
            raise ValueError("a mesh without UVs, or values that are not finite")
        return cls(mesh, image, about)

    def _arrays(self) -> dict[str, np.ndarray]:
        """What a model file holds."""
        return mesh_arrays(self.mesh) | {"image": self.image.astype(np.float16)}
