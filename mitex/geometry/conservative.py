"""The conservative raster of a UV layout: every texel whose closed square overlaps a face."""

from __future__ import annotations

import numpy as np

from mitex.geometry.raster import nearest_last, texels_in_boxes
from mitex.geometry.triangles import barycentric_gradients, nearest_on_border, twice_area

CHUNK = 1 << 17  # texels that are looked at together: a megabyte per array stays in the cache
FLAT = 1e-12  # [texel^2] faces of a smaller area in the layout show nothing
ON_EDGE = 1e-9  # [texel] a centre so close to a face is on its edge


class _EdgeFunctions:
    """The edge functions of triangles: twice the areas that a point spans with each edge, positive inside.

    Unlike barycentric coordinates they are not divided by the triangle's area. So the test whether a triangle
    touches a square is exact where coordinates are short binary fractions, as on layouts aligned with
    the texels.

    Args:
        triangles: (F, 3, 2) [texel].

    Attributes:
        area: (F,) twice the areas [texel^2].
        reach: (3, F) by how much each function grows from a texel's centre to the corner where it is largest.
    """

    def __init__(self, triangles: np.ndarray):
        signed = twice_area(triangles)
        self.area = np.abs(signed)
        origin, slopes = barycentric_gradients(triangles, np.sign(signed))
        self._origin = np.ascontiguousarray(origin.T)
        self._slope = np.ascontiguousarray(slopes.T)
        dx, dy = self._slope[::2], self._slope[1::2]
        half = 0.5 * (np.abs(dx) + np.abs(dy))
        self.reach = np.concatenate([0.5 * (np.abs(dx.sum(axis=0)) + np.abs(dy.sum(axis=0)))[None], half])

    def __call__(self, face: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
        """(3, M) values of the faces (M,) at points (M,)."""
        dx, dy = column - self._origin[0][face], row - self._origin[1][face]
        value = np.empty((3, len(face)))
        for k in (1, 2):
            value[k] = self._slope[2 * k - 2][face] * dx + self._slope[2 * k - 1][face] * dy
        value[0] = self.area[face] - value[1] - value[2]
        return value


def cover(corners: np.ndarray, resolution: int) -> tuple[np.ndarray, np.ndarray]:
    """Which face each texel shows.

    A triangle and a square overlap unless an axis separates them: one of the square's two normals (the
    texel is not in the triangle's bounding box) or of the triangle's three (an edge function is negative on
    the whole square).

    Args:
        corners: (F, 3, 2) float64 (column, row) [texel].
        resolution: R, side of the map [texels].

    Returns:
        (R * R,) int32 faces, -1 for none, and (R * R,) float64 distances from the centre [texel], 0 inside.
    """
    edges = _EdgeFunctions(corners)
    low = np.maximum(np.ceil(corners.min(axis=1) - 0.5), 0).astype(np.int64)
    high = np.minimum(np.floor(corners.max(axis=1) + 0.5), resolution - 1).astype(np.int64)
    high[edges.area <= FLAT] = -1
    owner = np.full(resolution**2, -1, np.int32)
    best = np.full(resolution**2, np.inf)
    for face, column, row in texels_in_boxes(low, high, CHUNK):
        value = edges(face, column, row)
        reach = edges.reach[:, face]
        over = np.flatnonzero((value + reach).min(axis=0) >= 0.0)
        face, column, row = face[over], column[over], row[over]
        inside = (value[:, over] + 2.0 * ON_EDGE * reach[:, over]).min(axis=0) >= 0.0
        texel = row * resolution + column
        _write_nearest(owner, best, texel[inside], face[inside], np.zeros(inside.sum()))
        border = np.flatnonzero(~inside)
        border = border[best[texel[border]] > 0.0]
        points = np.stack([column[border], row[border]], axis=1)
        _, distance = nearest_on_border(corners[face[border]], points)
        _write_nearest(owner, best, texel[border], face[border], distance)
    return owner, best


def _write_nearest(
    owner: np.ndarray, best: np.ndarray, texel: np.ndarray, face: np.ndarray, distance: np.ndarray
) -> None:
    order = nearest_last(best, texel, distance)
    best[texel[order]] = distance[order]
    owner[texel[order]] = face[order]


def nearest_points(
    corners: np.ndarray, face: np.ndarray, point: np.ndarray, inside: np.ndarray
) -> np.ndarray:
    """(N, 3) barycentrics of the points (N, 2) in their faces (N,), or of the nearest points of those."""
    edges = _EdgeFunctions(corners)
    barycentric = np.empty((len(face), 3))
    for start in range(0, len(face), CHUNK):
        part = slice(start, start + CHUNK)
        barycentric[part] = np.maximum(edges(face[part], *point[part].T), 0.0).T
    outside = np.flatnonzero(~inside)
    barycentric[outside] = nearest_on_border(corners[face[outside]], point[outside])[0]
    return barycentric / barycentric.sum(axis=1, keepdims=True)
