"""Self-intersections: edges that pierce a face of the same mesh."""

from __future__ import annotations

import numpy as np

from mitex.mesh import Mesh
from mitex.mesh.topology import mesh_edges
from mitex.runtime import init
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload
from mitex.scenes.shapes import mesh_shape

PAST = 1e-4  # part of an edge by which a ray goes on behind a face that it may touch


def crossing_edges(mesh: Mesh) -> np.ndarray:
    """(E, 2) int64 vertex pairs of the edges that pierce a face not their own, found by rays along them.

    Two faces that cross have at least one such edge; faces that lie in one plane are not found.
    """
    init(needs="ad")
    scene = mi.load_dict({"type": "scene", "mesh": mesh_shape(mesh)})
    pairs, _ = mesh_edges(mesh.faces, len(mesh.vertices))
    start, end = (mesh.vertices[pairs[:, k]] for k in range(2))
    crossing = np.zeros(len(pairs), bool)
    rest, offset = np.arange(len(pairs)), np.full(len(pairs), PAST, np.float32)
    while len(rest):
        hit, face, t = _first(scene, start[rest], end[rest], offset)
        face, t = face[hit], t[hit]
        corners = mesh.faces[face]
        own = (corners[:, :, None] == pairs[rest[hit]][:, None]).any((1, 2))
        crossing[rest[hit][~own]] = True
        rest, offset = rest[hit][own], np.nextafter(t[own] + PAST, np.float32(2))
    return pairs[crossing]


def _first(
    scene: mi.Scene, start: np.ndarray, end: np.ndarray, offset: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of edges, from the fraction `offset` of their length on: whether a face is hit, which, and where."""
    way = end - start
    origin = mi.Point3f(np.ascontiguousarray((start + offset[:, None] * way).T))
    ray = mi.Ray3f(origin, mi.Vector3f(np.ascontiguousarray(way.T)))
    ray.maxt = upload(mi.Float, np.maximum(1 - PAST - offset, 0))
    hits = scene.ray_intersect_preliminary(ray)
    hit, face, t = (np.asarray(a) for a in (hits.is_valid(), hits.prim_index, hits.t))
    return hit.astype(bool), face, offset + t
