"""Displacement maps: a height map of a reference, put on a mesh (Hertz et al. 2020, figure 11).

The authors draw the map by hand. Here it is baked, as modelling programs do: a square window is looked at
from outside, along parallel rays, and what remains of the depths after the large shape is taken off are the
heights. What hangs over is hidden, and vertices move along their normals only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy.ndimage import map_coordinates

from mitex.asset import Asset, clay
from mitex.atlas import laid_out
from mitex.errors import ConfigError
from mitex.geometry.triangles import twice_area
from mitex.mesh import Mesh, subdivide_midpoint
from mitex.methods.baselines.displacement import METHOD
from mitex.methods.baselines.displacement.config import SUBDIVISIONS
from mitex.methods.checks import in_range
from mitex.ranges import SCALES
from mitex.runtime import init
from mitex.runtime.jit import mi
from mitex.scenes.shapes import mesh_shape
from mitex.training import model_file

ATLAS = 1024  # resolution that the target's charts are packed for


@dataclass(frozen=True, eq=False)
class DisplacementMap:
    """Heights of a square piece of a surface.

    Attributes:
        heights: (N, N) float64, mean 0; rows go along v, columns along u [roots of the reference's area].
        side: of the square [roots of the reference's area].
        about: how it was made.
    """

    heights: np.ndarray
    side: float
    about: Mapping[str, Any] = field(default_factory=dict)

    @staticmethod
    def bake(reference: Mesh, resolution: int = 256, window: float = 0.35) -> DisplacementMap:
        """Takes the map off the side of the reference that faces +z.

        Args:
            reference: whose relief it is.
            resolution: side of the map [texels].
            window: side of the square that is taken off [of the reference's extent].

        Raises:
            ConfigError: the reference does not fill the window.
        """
        low, high = reference.vertices.min(0), reference.vertices.max(0)
        extent, centre = float((high - low).max()), 0.5 * (low + high)
        side = window * extent
        place = (np.arange(resolution) + 0.5) / resolution - 0.5
        x, y = (side * a.ravel() for a in np.meshgrid(place, place))
        start = np.stack([centre[0] + x, centre[1] + y, np.full_like(x, high[2] + extent)], 1)
        depth = _depth(reference, start)
        if not np.isfinite(depth).all():
            raise ConfigError(
                f"'{reference.name}' has holes where a height map is taken off", "turn another side to +z"
            )
        # A quadric is the large shape: what is left are the heights.
        terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], 1)
        heights = -depth - terms @ np.linalg.lstsq(terms, -depth, rcond=None)[0]
        unit = float(np.sqrt(reference.face_areas.sum(dtype=np.float64)))
        return DisplacementMap(heights.reshape(resolution, resolution) / unit, side / unit)

    @classmethod
    def load(cls, source: str | Path) -> DisplacementMap:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        with model_file.opened(source, METHOD.name) as (tensors, about):
            heights, side = tensors["heights"].numpy(), float(tensors["side"])
            if heights.ndim != 2 or heights.shape[0] != heights.shape[1]:
                raise ValueError(f"heights of shape {heights.shape}")
            if not np.isfinite(heights).all() or not 0 < side < np.inf:
                raise ValueError("values that are not finite, or a square without a side")
            return cls(heights, side, about)

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors).

        Raises:
            OutputError: the place is not writable.
        """
        tensors = {
            "heights": torch.from_numpy(self.heights),
            "side": torch.tensor(self.side, dtype=torch.float64),
        }
        return model_file.save(path, tensors, METHOD.name, self.about)

    def apply(self, mesh: Mesh, *, scale: float = 1.0, subdivide: int = 0) -> Asset:
        """A mesh displaced along its normals by the map, repeated in mirrored squares over its UVs.

        Args:
            mesh: its own UVs are used if they do not overlap, else new ones.
            scale: size of the features beside the whole mesh, against that on the reference.
            subdivide: how often every face is split in four first.

        Returns:
            The displaced mesh in light grey; where charts meet, heights are averaged and the pattern breaks.

        Raises:
            MeshError: the mesh has no area.
            ConfigError: a number is out of range.
        """
        in_range("`scale`", scale, *SCALES)
        in_range("`subdivide`", subdivide, *SUBDIVISIONS)
        fine = subdivide_midpoint(laid_out(mesh, ATLAS), subdivide)
        assert fine.uv is not None
        area = float(fine.face_areas.sum(dtype=np.float64))
        stretch = np.sqrt(area / max(0.5 * np.abs(twice_area(fine.uv)).sum(), 1e-12))  # [mesh units per UV]
        unit = scale * np.sqrt(area)  # of the map's lengths, on this mesh
        squares = fine.uv * (stretch / (self.side * unit))
        at = squares[..., ::-1].reshape(-1, 2).T * len(self.heights) - 0.5
        corners = map_coordinates(self.heights, at, order=1, mode="reflect") * unit
        count = np.maximum(np.bincount(fine.faces.ravel(), minlength=len(fine.vertices)), 1)
        height = np.bincount(fine.faces.ravel(), corners, len(fine.vertices)) / count
        return clay(fine.with_vertices(fine.vertices + height[:, None] * fine.normals))


def _depth(mesh: Mesh, start: np.ndarray) -> np.ndarray:
    """(N,) float64 how far along -z from points (N, 3) the mesh is first met; infinite where it is not."""
    init(needs="ad")
    scene = mi.load_dict({"type": "scene", "mesh": mesh_shape(mesh)})
    rays = mi.Ray3f(mi.Point3f(np.ascontiguousarray(start.T, np.float32)), mi.Vector3f(0, 0, -1))
    hits = scene.ray_intersect_preliminary(rays)
    hit, t = np.asarray(hits.is_valid()).astype(bool), np.asarray(hits.t)
    return np.where(hit, t, np.inf).astype(np.float64)
