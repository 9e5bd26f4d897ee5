"""The Laplacian of functions that are linear on each triangle: weights of edges and areas of vertices."""

from __future__ import annotations

import numpy as np

from mitex.geometry.vectors import dot
from mitex.mesh.mesh import Mesh
from mitex.mesh.topology import face_edges

LEAST = 1e-12  # area of a face, at least, relative to the largest


def vertex_areas(mesh: Mesh) -> np.ndarray:
    """(V,) float64 a third of the areas of the faces around each vertex [mesh units^2]."""
    thirds = np.repeat(mesh.face_areas.astype(np.float64) / 3, 3)
    return np.bincount(mesh.faces.ravel(), thirds, len(mesh.vertices))


def cotangent_weights(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """The edges and their weights: (Laplacian of f)_i = sum_j w_ij (f_i - f_j), over the area at i.

    w_ij is half the sum of the cotangents of the angles opposite to the edge, negative where the two add up
    to more than 180 degrees.

    Returns:
        (E, 2) int64 vertex pairs as `mesh_edges` gives them, and (E,) float64.
    """
    pairs, sides = face_edges(mesh.faces, len(mesh.vertices))
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    twice = np.linalg.norm(mesh.face_crosses, axis=1)
    twice = np.maximum(twice, LEAST * max(float(twice.max(initial=0.0)), 1e-300))
    # The side from corner k to k + 1 lies opposite to corner k - 1.
    opposite = np.roll(corners, 1, axis=1)
    cotangents = dot(corners - opposite, np.roll(corners, -1, axis=1) - opposite) / twice[:, None]
    return pairs, 0.5 * np.bincount(sides.ravel(), cotangents.ravel(), len(pairs))
