"""How points that move in space move in the images of cameras."""

from __future__ import annotations

import math

import numpy as np

from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.scenes.cameras import Cameras
from mitex.scenes.stage import Hits


def surface_motion(cameras: Cameras, mesh: Mesh, hits: Hits, velocities: np.ndarray) -> np.ndarray:
    """How a surface that moves along a field moves in images, (K, H, W, 2) float32 [px].

    x to the right, y down; 0 where there is no surface.

    Args:
        cameras: K cameras.
        mesh: V vertices.
        hits: what one sample in each of the cameras' pixels sees of it.
        velocities: (V, 3) [mesh units].
    """
    hit, corners = hits.hit.numpy(), mesh.faces[hits.face.numpy()]
    weights = hits.barycentric.numpy().astype(np.float64)
    points, velocities = (interpolate(weights, values[corners]) for values in (mesh.vertices, velocities))
    camera = np.flatnonzero(hit) // (cameras.width * cameras.height)
    motion = np.zeros((len(hit), 2), np.float32)
    motion[hit] = screen_motion(cameras, camera, points, velocities)
    return motion.reshape(*cameras.shape, 2)


def screen_motion(
    cameras: Cameras, camera: np.ndarray, points: np.ndarray, velocities: np.ndarray
) -> np.ndarray:
    """The velocities of points in images, (P, 2) [px]: x to the right, y down.

    The derivative of each point's projection along its velocity. MeshNCA projects the velocity alone, which
    is the same for orthographic cameras.

    Args:
        cameras: K cameras.
        camera: (P,) which of them looks at each point.
        points: (P, 3), in front of it [mesh units].
        velocities: (P, 3) [mesh units].
    """
    right, up, forward = (axis.astype(np.float64)[camera] for axis in cameras.axes())
    plane = np.stack([right, -up], axis=1)
    motion = np.einsum("pkd,pd->pk", plane, velocities)
    if cameras.kind == "orthographic":
        return motion * (0.5 * cameras.height / cameras.half_width)
    away = points - cameras.origin[camera].astype(np.float64)
    depth = dot(away, forward)[:, None]
    place = np.einsum("pkd,pd->pk", plane, away) / depth
    scale = 0.5 * cameras.height / math.tan(0.5 * math.radians(cameras.fov))
    return scale * (motion - place * dot(velocities, forward)[:, None]) / depth
