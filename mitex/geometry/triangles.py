"""Triangles in rows of arrays: normals, areas, barycentric coordinates."""

from __future__ import annotations

import numpy as np

from mitex.geometry.vectors import cross_2d, dot


def triangle_crosses(p: np.ndarray) -> np.ndarray:
    """(..., 3) normals of triangles (..., 3, 3); their lengths are twice the areas."""
    return np.cross(p[..., 1, :] - p[..., 0, :], p[..., 2, :] - p[..., 0, :])


def twice_area(p: np.ndarray) -> np.ndarray:
    """(F,) twice the signed areas of triangles (F, 3, 2)."""
    return cross_2d(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])


def interpolate(barycentric: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(N, C) sums of the values (N, K, C) of K corners with the weights (N, K)."""
    return np.einsum("nk,nkc->nc", barycentric, corners)


def scattered(areas: np.ndarray, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of triangles, uniform over their areas.

    Args:
        areas: (F,) of the triangles.
        numbers: (3, N) random, uniform in [0, 1).

    Returns:
        (N,) triangles, and (N, 3) barycentric coordinates in them.
    """
    choice, r, v = numbers
    cumulative = np.cumsum(areas, dtype=np.float64)
    face = np.searchsorted(cumulative, choice * cumulative[-1], side="right").clip(max=len(areas) - 1)
    root = np.sqrt(r)
    return face, np.stack([1 - root, root * (1 - v), root * v], axis=1)


def barycentric_gradients(p: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First corners (F, 2) and gradients (F, 4), (db1/dx, db1/dy, db2/dx, db2/dy), of triangles (F, 3, 2).

    Args:
        p: the triangles.
        area: (F,) their `twice_area`.
    """
    a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    inverse = np.divide(1.0, area, out=np.zeros_like(area), where=area != 0)[:, None]
    return p[:, 0], np.stack([b[:, 1], -b[:, 0], -a[:, 1], a[:, 0]], axis=1) * inverse


def nearest_on_border(triangles: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points of the borders of triangles (M, 3, 2) nearest to points (M, 2).

    Returns:
        (M, 3) barycentric coordinates, and (M,) distances.
    """
    barycentric = np.zeros((len(points), 3))
    best = np.full(len(points), np.inf)
    for k, end in ((0, 1), (1, 2), (2, 0)):
        along, to = triangles[:, end] - triangles[:, k], points - triangles[:, k]
        length2 = np.maximum((along**2).sum(axis=1), np.finfo(along.dtype).tiny)
        t = np.clip((to * along).sum(axis=1) / length2, 0.0, 1.0)
        distance = np.linalg.norm(to - t[:, None] * along, axis=1)
        closer = np.flatnonzero(distance < best)
        best[closer] = distance[closer]
        barycentric[closer] = 0.0
        barycentric[closer, k], barycentric[closer, end] = 1.0 - t[closer], t[closer]
    return barycentric, best


def nearest_on_triangles(triangles: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points of triangles (M, 3, 3) nearest to points (M, 3).

    Returns:
        (M, 3) barycentric coordinates, and (M,) distances.
    """
    crosses = triangle_crosses(triangles)
    square = np.maximum(dot(crosses, crosses), np.finfo(np.float64).tiny)[:, None]
    corners = triangles - points[:, None]
    parts = [np.cross(corners[:, k - 2], corners[:, k - 1]) for k in range(3)]
    barycentric = np.stack([dot(part, crosses) for part in parts], axis=1) / square
    inside = (barycentric >= 0).all(axis=1) & (dot(crosses, crosses) > 0)
    barycentric[~inside] = 0.0
    best = np.where(inside, 0.0, np.inf)
    best[inside] = np.linalg.norm(np.einsum("mk,mkd->md", barycentric, corners)[inside], axis=1)
    for k, end in ((0, 1), (1, 2), (2, 0)):
        along = corners[:, end] - corners[:, k]
        length2 = np.maximum(dot(along, along), np.finfo(np.float64).tiny)
        t = np.clip(-dot(corners[:, k], along) / length2, 0.0, 1.0)
        distance = np.linalg.norm(corners[:, k] + t[:, None] * along, axis=1)
        closer = np.flatnonzero(~inside & (distance < best))
        best[closer] = distance[closer]
        barycentric[closer] = 0.0
        barycentric[closer, k], barycentric[closer, end] = 1.0 - t[closer], t[closer]
    return barycentric, best
