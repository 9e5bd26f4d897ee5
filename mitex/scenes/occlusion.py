"""Ambient occlusion: how much of the sky above a surface point is free."""

from __future__ import annotations

import numpy as np

from mitex.mesh import Mesh
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.scenes.stage import mesh_shape

RAYS = 1 << 23  # traced at once
OFFSET = 1e-4  # how far above the surface rays start, as a part of the mesh's extent


def ambient_occlusion(
    mesh: Mesh, points: np.ndarray, normals: np.ndarray, samples: int = 128, seed: int = 0
) -> np.ndarray:
    """The part of the cosine-weighted hemisphere above each point from which nothing is hit.

    Args:
        mesh: what occludes, from both sides.
        points: (N, 3) on the surface [mesh units].
        normals: (N, 3) unit.
        samples: rays for each point.
        seed: of the rays.

    Returns:
        (N,) float32 in [0, 1], 1 where the sky is free.
    """
    init(needs="ad")
    scene = mi.load_dict({"type": "scene", "mesh": mesh_shape(mesh)})
    offset = OFFSET * float(np.ptp(mesh.vertices, axis=0).max())
    openness = np.empty(len(points), np.float32)
    count = max(RAYS // samples, 1)
    for start in range(0, len(points), count):
        part = slice(start, start + count)
        openness[part] = _open(
            scene, points[part] + offset * normals[part], normals[part], samples, seed + start
        )
    return openness


def _open(scene: mi.Scene, origins: np.ndarray, normals: np.ndarray, samples: int, seed: int) -> np.ndarray:
    count = len(origins)
    index = dr.arange(mi.UInt32, count) if samples == 1 else dr.repeat(dr.arange(mi.UInt32, count), samples)
    origin, normal = (
        dr.gather(mi.Point3f, mi.Point3f(np.ascontiguousarray(a.T, np.float32)), index)
        for a in (origins, normals)
    )
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed % 2**32, count * samples)
    local = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
    ray = mi.Ray3f(origin, mi.Frame3f(mi.Vector3f(normal)).to_world(local))
    free = dr.select(scene.ray_test(ray), 0.0, 1.0)
    return np.array(dr.block_sum(mi.Float(free), samples)) / samples
