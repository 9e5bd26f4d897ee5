"""`QuiltedTexture`: a tileable picture of a captured texture, put on meshes as a flat texture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.asset import Asset
from mitex.atlas import laid_out
from mitex.evaluation.elevations import FlatTexture
from mitex.export.common import asset_from_textures
from mitex.mesh import Mesh
from mitex.methods.baselines.quilted import METHOD
from mitex.methods.checks import in_range
from mitex.methods.nerf.training.light_estimate import brightness
from mitex.methods.nerf.use.placement import UNWRAP_SIZE, in_scene_cube, uv_unit_length
from mitex.methods.planar import repeated
from mitex.ranges import SCALES, TEXELS
from mitex.training import model_file


@dataclass(frozen=True, eq=False)
class QuiltedTexture:
    """A picture that repeats beyond its borders.

    Attributes:
        image: (T, T, 3) float32 sRGB in [0, 1], row 0 on top.
        gap: between texels [scene units of the capture].
        about: how it was made; where the light of the capture was taken off, `light` is that.
    """

    image: np.ndarray
    gap: float
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> QuiltedTexture:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        with model_file.opened(source, METHOD.name) as (tensors, about):
            image, gap = tensors["image"].numpy(), float(tensors["gap"])
            if image.ndim != 3 or image.shape[0] != image.shape[1] or image.shape[2] != 3:
                raise ValueError(f"an image of shape {image.shape}")
            if not np.isfinite(image).all() or not 0 < gap < np.inf:
                raise ValueError("values that are not finite, or texels without a size")
            if "light" in about and not np.isfinite(np.array(about["light"], np.float64).reshape(16)).all():
                raise ValueError("a light that is not finite")
            return cls(image, gap, about)

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors).

        Raises:
            OutputError: the place is not writable.
        """
        tensors = {
            "image": torch.from_numpy(self.image),
            "gap": torch.tensor(self.gap, dtype=torch.float64),
        }
        return model_file.save(path, tensors, METHOD.name, self.about)

    def on_plane(self, along: np.ndarray) -> FlatTexture:
        """What shows the picture in the windows of photos of the capture, in its light.

        Args:
            along: (3,) direction in the scene that the planes' x follows.
        """
        light = self.about.get("light")
        shine = None if light is None else partial(plane_brightness, np.array(light, np.float64))
        return FlatTexture(self.image, self.gap, along, brightness=shine)

    def apply(self, mesh: Mesh, *, scale: float = 1.0, resolution: int = 1024) -> Asset:
        """Puts the picture on any mesh, repeated over its UVs.

        Args:
            mesh: its own UVs are used if they do not overlap, else new ones.
            scale: size of the texture's elements beside the whole mesh, against that on the captured object.
            resolution: side of the asset's albedo [texels], 16 to 8192.

        Returns:
            The mesh with an albedo texture, whose texels show the mean light of what they cover. Where charts
            meet, the pattern breaks.

        Raises:
            MeshError: the mesh has no area.
            ConfigError: a number is out of range.
        """
        in_range("`scale`", scale, *SCALES)
        in_range("`resolution`", resolution, *TEXELS)
        mesh = laid_out(mesh, UNWRAP_SIZE)
        assert mesh.uv is not None
        unit_length = uv_unit_length(in_scene_cube(mesh)[0])
        albedo = repeated(self.image, unit_length / (self.gap * scale), resolution)
        return asset_from_textures(mesh, mesh.uv, {"albedo": albedo}, mesh.name)


def plane_brightness(light: np.ndarray, normal: np.ndarray) -> float:
    """How bright a light (16,) makes a plane with this normal (3,)."""
    return float(brightness(light, normal[None])[0])
