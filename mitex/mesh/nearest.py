"""The points of a mesh that are nearest to others."""

from __future__ import annotations

import weakref

import numpy as np
from scipy.spatial import KDTree

from mitex.geometry.triangles import nearest_on_triangles
from mitex.mesh.mesh import Mesh

CANDIDATES = 8  # faces whose distance is computed

_trees: weakref.WeakKeyDictionary[Mesh, KDTree] = weakref.WeakKeyDictionary()


def nearest_points(mesh: Mesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points of a mesh that are nearest to points (P, 3), among the faces with the nearest centres.

    Returns:
        (P,) int32 faces and (P, 3) float32 barycentric coordinates.
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    if mesh not in _trees:
        _trees[mesh] = KDTree(corners.mean(axis=1))
    count = min(CANDIDATES, len(corners))
    _, faces = _trees[mesh].query(points, k=count, workers=-1)
    faces = np.asarray(faces).reshape(len(points), count)
    best, face, barycentric = np.full(len(points), np.inf), faces[:, 0].copy(), np.zeros((len(points), 3))
    for candidate in faces.T:
        weights, distance = nearest_on_triangles(corners[candidate], points)
        closer = distance < best
        best[closer], face[closer], barycentric[closer] = distance[closer], candidate[closer], weights[closer]
    return face.astype(np.int32), barycentric.astype(np.float32)
