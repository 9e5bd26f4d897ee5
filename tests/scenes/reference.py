"""A slow ray tracer and lookup, written independently of Mitsuba, in double precision."""

from dataclasses import replace

import numpy as np

from mitex.mesh import Mesh
from mitex.scenes.cameras import Cameras


def trace(mesh: Mesh, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nearest triangle (-1 for none) and barycentric weights for rays (N, 3), by testing every pair."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    face, weights = np.full(len(origins), -1), np.zeros((len(origins), 3))
    for ray, (o, d) in enumerate(zip(origins.astype(np.float64), directions.astype(np.float64), strict=True)):
        # o + t d = a + u (b - a) + v (c - a), by Cramer's rule for every triangle.
        columns = np.stack((b - a, c - a, np.broadcast_to(-d, a.shape)), axis=2)
        determinant = np.linalg.det(columns)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, t = (
                np.linalg.det(np.where(np.arange(3) == k, (o - a)[:, :, None], columns)) / determinant
                for k in range(3)
            )
            inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        if inside.any():
            nearest = np.argmin(np.where(inside, t, np.inf))
            face[ray] = nearest
            weights[ray] = 1 - u[nearest] - v[nearest], u[nearest], v[nearest]
    return face, weights


def matrix(mesh: Mesh, cameras: Cameras, antialias: int = 1) -> np.ndarray:
    """(K, H, W, V) dense weights of every vertex in every pixel, float64."""
    fine = replace(cameras, width=cameras.width * antialias, height=cameras.height * antialias)
    origins, directions = fine.rays()
    face, weights = trace(mesh, origins.reshape(-1, 3), directions.reshape(-1, 3))
    dense = np.zeros((len(face), len(mesh.vertices)))
    for row in np.flatnonzero(face >= 0):
        for vertex, weight in zip(mesh.faces[face[row]], weights[row], strict=True):
            dense[row, vertex] += weight
    count, height, width = cameras.shape
    split = dense.reshape(count, height, antialias, width, antialias, -1)
    return split.mean(axis=(2, 4))


def images(
    mesh: Mesh, cameras: Cameras, field: np.ndarray, background: float | np.ndarray = 0.0, antialias: int = 1
) -> np.ndarray:
    """(K, H, W, C) pictures of a field (V, C), float64."""
    weights = matrix(mesh, cameras, antialias)
    return weights @ field + (1 - weights.sum(-1, keepdims=True)) * background
