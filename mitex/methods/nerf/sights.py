"""What the pixels of photos see of the base shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.mesh import Mesh
from mitex.methods.nerf.capture import Capture
from mitex.methods.nerf.tensors import channels, rows
from mitex.runtime import init
from mitex.runtime.jit import mi
from mitex.scenes.stage import mesh_shape


@dataclass(frozen=True, eq=False)
class Sight:
    """What pixels (H, W) see.

    Attributes:
        angle: to the normal, 180 where the mesh is missed [degrees].
        points, normals: (H, W, 3) of the mesh, smooth normals of length 1.
    """

    angle: np.ndarray
    points: np.ndarray
    normals: np.ndarray


class Sights:
    """Looks at a mesh in the scene cube through the cameras of a capture."""

    def __init__(self, mesh: Mesh, capture: Capture) -> None:
        init()
        self.capture = capture
        self._scene = mi.load_dict({"type": "scene", "mesh": mesh_shape(mesh, smooth=True)})

    def __call__(self, view: int, stride: int = 1) -> Sight:
        """Every `stride`-th pixel of a view, in both directions."""
        height, width = self.capture.images[view].shape[:2]
        window = slice(0, height, stride), slice(0, width, stride)
        origins, directions = window_rays(self.capture, view, window)
        ray = mi.Ray3f(channels(mi.Point3f, origins), channels(mi.Vector3f, directions))
        met = self._scene.ray_intersect(ray)
        points, normals = rows(met.p), rows(met.sh_frame.n)
        angle = np.degrees(np.arccos(np.clip(-(normals * directions).sum(1), -1, 1)))
        angle[~np.array(met.is_valid()).astype(bool)] = 180.0
        shape = np.mgrid[window].shape[1:]
        return Sight(*(values.reshape(*shape, *values.shape[1:]) for values in (angle, points, normals)))


def window_rays(capture: Capture, view: int, window: tuple[slice, slice]) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions (N, 3) of the pixels of a window (rows, columns), row by row."""
    y, x = np.mgrid[window]
    pixels = np.stack([x.ravel(), y.ravel()], axis=1) + 0.5
    return capture.rays(np.full(len(pixels), view), pixels)
