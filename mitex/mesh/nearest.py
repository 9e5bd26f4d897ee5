"""The points of a mesh that are nearest to others."""

from __future__ import annotations

import weakref

import numpy as np
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from mitex.geometry.triangles import nearest_on_triangles
from mitex.mesh.matrices import edge_lengths
from mitex.mesh.mesh import Mesh
from mitex.runtime.workers import tree_threads

CANDIDATES, MORE_CANDIDATES = 8, 64  # faces whose distance is computed
NEAR = 1e-5  # distance of points on the surface [extents of the mesh], by rounding

_trees: weakref.WeakKeyDictionary[Mesh, KDTree] = weakref.WeakKeyDictionary()


def nearest_points(mesh: Mesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points of a mesh that are nearest to points (P, 3), among the faces with the nearest centres.

    Returns:
        (P,) int32 faces and (P, 3) float32 barycentric coordinates.
    """
    face, barycentric, _ = _candidates(mesh, points, CANDIDATES)
    return face.astype(np.int32), barycentric.astype(np.float32)


def surface_points(mesh: Mesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points of a mesh nearest to points (P, 3) on or near it: faces (P,), barycentrics (P, 3) float64.

    On an uneven mesh the nearest face need not be among those with the nearest centres; where these are not
    at the point, more are looked at, and the largest faces.
    """
    face, barycentric, distance = _candidates(mesh, points, CANDIDATES)
    far = distance > NEAR * np.ptp(mesh.vertices, axis=0).max()
    if far.any():
        face[far], barycentric[far], _ = _candidates(mesh, points[far], MORE_CANDIDATES, MORE_CANDIDATES)
    return face, barycentric


def _candidates(
    mesh: Mesh, points: np.ndarray, count: int, largest: int = 0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Face, barycentrics and distance of the nearest point in the `count` faces with the nearest centres, and
    in some of the largest faces.
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    centres = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    if mesh not in _trees:
        _trees[mesh] = KDTree(centres)
    count = min(count, len(corners))
    _, faces = _trees[mesh].query(points, k=count, workers=tree_threads(len(points)))
    faces = np.asarray(faces).reshape(len(points), count)
    large = np.argsort(-mesh.face_areas)[:largest]
    faces = np.column_stack([faces, np.broadcast_to(large, (len(points), len(large)))])
    best, face, barycentric = np.full(len(points), np.inf), faces[:, 0].copy(), np.zeros((len(points), 3))
    for candidate in faces.T:
        least = np.linalg.norm(points - centres[candidate], axis=1) - reach[candidate]
        maybe = np.flatnonzero(least < best)
        if not len(maybe):
            continue
        weights, distance = nearest_on_triangles(corners[candidate[maybe]], points[maybe])
        closer = distance < best[maybe]
        row = maybe[closer]
        best[row], face[row], barycentric[row] = distance[closer], candidate[row], weights[closer]
    return face, barycentric, best


def distances(mesh: Mesh, places: np.ndarray, limit: float = np.inf) -> np.ndarray:
    """(V,) straight to that of some vertices that is nearest along the edges [mesh units].

    Infinite where none of them is near enough, as in parts of the mesh that have none.

    Args:
        mesh: V vertices.
        places: (N,) those vertices.
        limit: of the way along the edges [mesh units].
    """
    graph = edge_lengths(mesh.faces, mesh.vertices.astype(np.float64))
    _, _, nearest = dijkstra(graph, indices=places, min_only=True, limit=limit, return_predecessors=True)
    away, there = np.full(len(nearest), np.inf), nearest >= 0
    away[there] = np.linalg.norm(mesh.vertices[there] - mesh.vertices[nearest[there]], axis=1)
    return away
