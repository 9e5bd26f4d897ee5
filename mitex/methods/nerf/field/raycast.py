"""Rays of photos against a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.mesh import Mesh
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.runtime import init
from mitex.runtime.jit import mi
from mitex.scenes.stage import mesh_shape


@dataclass(frozen=True, eq=False)
class PixelHits:
    """Where the rays of pixels (H, W) meet a mesh.

    Attributes:
        angle: between the ray and the normal, 180 where the mesh is missed [degrees].
        points, normals: (H, W, 3) of the mesh, smooth normals of length 1.
    """

    angle: np.ndarray
    points: np.ndarray
    normals: np.ndarray


class Raycaster:
    """Casts the rays of a capture onto a mesh in the scene cube."""

    def __init__(self, mesh: Mesh, capture: Capture) -> None:
        init(needs="ad")
        self.capture = capture
        self._scene = mi.load_dict({"type": "scene", "mesh": mesh_shape(mesh, smooth=True)})

    def __call__(self, view: int, stride: int = 1) -> PixelHits:
        """Hits of every `stride`-th pixel of a view, in both directions."""
        height, width = self.capture.images[view].shape[:2]
        window = slice(0, height, stride), slice(0, width, stride)
        origins, directions = window_rays(self.capture, view, window)
        ray = mi.Ray3f(channels(mi.Point3f, origins), channels(mi.Vector3f, directions))
        hits = self._scene.ray_intersect(ray)
        points, normals = rows(hits.p), rows(hits.sh_frame.n)
        angle = np.degrees(np.arccos(np.clip(-(normals * directions).sum(1), -1, 1)))
        angle[~np.array(hits.is_valid()).astype(bool)] = 180.0
        shape = np.mgrid[window].shape[1:]
        return PixelHits(*(values.reshape(*shape, *values.shape[1:]) for values in (angle, points, normals)))


def window_rays(capture: Capture, view: int, window: tuple[slice, slice]) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions (N, 3) of the pixels of a window (rows, columns), row by row."""
    y, x = np.mgrid[window]
    pixels = np.stack([x.ravel(), y.ravel()], axis=1) + 0.5
    return capture.rays(np.full(len(pixels), view), pixels)
