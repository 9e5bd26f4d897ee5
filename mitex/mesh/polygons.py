"""Polygons to triangles."""

from __future__ import annotations

import numpy as np

from mitex.errors import MeshError
from mitex.geometry.triangles import triangle_crosses
from mitex.geometry.vectors import cross_2d

MAX_CORNERS = 2000


def triangulate(points: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Cuts polygons into triangles that keep their winding and order.

    A quad is cut along its shorter diagonal, or along the one that stays inside where only one does; larger
    polygons by ear clipping in their mean plane, shortest cut first.

    Args:
        points: (V, 3) positions.
        corners: (N,) indices into `points`, polygon after polygon.
        sizes: (P,) number of corners of each polygon; smaller than 3 gives nothing.

    Returns:
        (T, 3) int64 indices into `corners`.

    Raises:
        MeshError: a polygon has more than 2000 corners.
    """
    if sizes.size and sizes.max() > MAX_CORNERS:
        raise MeshError(f"a face has {sizes.max()} corners", "triangulate the mesh before exporting it")
    starts = np.cumsum(sizes) - sizes
    owners, pieces = [], []
    for size in np.unique(sizes[sizes >= 3]):
        which = np.flatnonzero(sizes == size)
        index = starts[which, None] + np.arange(size)
        if size == 3:
            triangles = index
        elif size == 4:
            triangles = np.take_along_axis(index[:, None, :], _cut_quads(points[corners[index]]), axis=2)
        else:
            triangles = np.stack([row[_clip_ears(points[corners[row]])] for row in index])
        pieces.append(triangles.reshape(-1, 3))
        owners.append(np.repeat(which, size - 2))
    if not pieces:
        return np.empty((0, 3), np.int64)
    return np.concatenate(pieces)[np.argsort(np.concatenate(owners), kind="stable")]


def _cut_quads(quads: np.ndarray) -> np.ndarray:
    """(Q, 4, 3) positions -> (Q, 2, 3) corner numbers."""
    options = np.array([[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])
    cost = []
    for option, (start, end) in zip(options, ((0, 2), (1, 3)), strict=True):
        normals = triangle_crosses(quads[:, option])
        inside = np.einsum("qk,qk->q", normals[:, 0], normals[:, 1]) > 0.0
        length = np.linalg.norm(quads[:, start] - quads[:, end], axis=1)
        cost.append(np.where(inside, length, np.inf))
    # A hair of preference for the first diagonal makes exact squares come out alike.
    return options[(cost[1] < cost[0] * (1.0 - 1e-6)).astype(int)]


def _clip_ears(polygon: np.ndarray) -> np.ndarray:
    """(n, 3) positions -> (n - 2, 3) corner numbers."""
    plane = _flatten(polygon)
    left = np.arange(len(polygon))
    triangles = []
    while len(left) > 3:
        a, b, c = (plane[np.roll(left, shift)] for shift in (1, 0, -1))
        turn = cross_2d(b - a, c - b)
        ear = turn > 0.0
        for point in left[turn <= 0.0]:
            ear &= ~_contains(a, b, c, plane[point])
        length = np.linalg.norm(c - a, axis=1)
        if not ear.any():  # only for polygons that cross themselves
            ear[:] = True
        k = int(np.argmin(np.where(ear, length, np.inf)))
        triangles.append([left[k - 1], left[k], left[(k + 1) % len(left)]])
        left = np.delete(left, k)
    return np.array([*triangles, left])


def _flatten(polygon: np.ndarray) -> np.ndarray:
    """(n, 3) -> (n, 2) coordinates in the mean plane (Newell's normal), counter-clockwise."""
    centred = polygon - polygon.mean(axis=0)
    normal = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    plane = centred[:, [(axis + 1) % 3, (axis + 2) % 3]]
    return plane if normal[axis] >= 0.0 else plane[:, ::-1]


def _contains(a: np.ndarray, b: np.ndarray, c: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Whether counter-clockwise triangles contain a point, corners excepted."""
    inside = (
        (cross_2d(b - a, point - a) >= 0)
        & (cross_2d(c - b, point - b) >= 0)
        & (cross_2d(a - c, point - c) >= 0)
    )
    corner = (a == point).all(axis=1) | (b == point).all(axis=1) | (c == point).all(axis=1)
    return inside & ~corner
