"""What methods share that make a flat picture: the picture, and how it is laid over the UVs of a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import torch

from mitex.asset import Asset
from mitex.colour import linear_to_srgb, srgb_to_linear
from mitex.export.common import asset_from_textures
from mitex.mesh import Mesh
from mitex.methods.checks import in_range
from mitex.methods.layout import with_layout
from mitex.mip_map import MipMap
from mitex.ranges import SCALES, TEXELS
from mitex.training import model_file

CHUNK = 1 << 18  # texels looked up at a time


@dataclass(frozen=True, eq=False)
class PlanarTexture:
    """A flat picture that any mesh can wear; a method's own class names the method.

    Attributes:
        image: (T, T, 3) float32 sRGB in [0, 1], row 0 on top.
        texels: how many of its pixels lie along the side of a layout's square: as large as the texels that
            surface textures of this resolution have.
        about: how it was made.
    """

    method: ClassVar[str]

    image: np.ndarray
    texels: int
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> Self:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        with model_file.opened(source, cls.method) as (tensors, about):
            image, texels = tensors["image"].float().numpy(), int(tensors["texels"])
            if image.ndim != 3 or image.shape[0] != image.shape[1] or image.shape[2] != 3:
                raise ValueError(f"an image of shape {image.shape}")
            if not np.isfinite(image).all() or texels < 1:
                raise ValueError("values that are not finite, or pixels without a size")
            return cls(image, texels, about)

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors).

        Raises:
            OutputError: the place is not writable.
        """
        image = torch.from_numpy(self.image.astype(np.float16))
        tensors = {"image": image, "texels": torch.tensor(self.texels)}
        return model_file.save(path, tensors, self.method, self.about)

    def apply(
        self, mesh: Mesh, *, scale: float = 1.0, resolution: int = 512, keep_uvs: bool = False
    ) -> Asset:
        """Lays the picture over the UVs of any mesh, beyond its borders again and again.

        Args:
            mesh: any.
            scale: size of the pattern; 1 is that of a surface texture with the settings of the fit.
            resolution: side of the asset's albedo [texels], 16 to 8192.
            keep_uvs: use the mesh's own UVs, which must not overlap.

        Returns:
            The mesh with an albedo texture. Where charts meet, the pattern breaks.

        Raises:
            ConfigError: a number is out of range, or the mesh has no UVs that can be kept.
        """
        in_range("`scale`", scale, *SCALES)
        in_range("`resolution`", resolution, *TEXELS)
        unwrapped = with_layout(mesh, self.texels, keep_uvs)
        assert unwrapped.uv is not None
        albedo = repeated(self.image, self.texels / scale, resolution)
        return asset_from_textures(unwrapped, unwrapped.uv, {"albedo": albedo}, mesh.name)


def repeated(image: np.ndarray, length: float, resolution: int) -> np.ndarray:
    """(N, N, 3) sRGB in [0, 1]: what the unit square of the UVs shows of a picture, row 0 on top.

    Its lower left corner is that of the picture, which repeats. Texels show the mean light of what they
    cover.

    Args:
        image: (H, W, 3) sRGB in [0, 1].
        length: pixels of the picture along the square's side.
        resolution: N.
    """
    step = length / resolution
    along = (np.arange(resolution) + 0.5) * step
    column, row = np.meshgrid(along, along - length)
    places = np.stack([column.ravel(), row.ravel()], axis=1)
    look_up, footprint = MipMap(srgb_to_linear(image)), step * np.eye(2)
    colours = np.empty((len(places), 3), np.float32)
    for start in range(0, len(places), CHUNK):
        part = slice(start, start + CHUNK)
        footprints = np.broadcast_to(footprint, (len(places[part]), 2, 2))
        colours[part] = linear_to_srgb(look_up(places[part], footprints)).clip(0, 1)
    return colours.reshape(resolution, resolution, 3)
