"""The raster of a UV layout: which face a texel's centre lies in or near.

Texel (row r, column c) of N x N shows u = (c + 0.5) / N, v = 1 - (r + 0.5) / N: row 0 is the top.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mitex.geometry.triangles import barycentric_gradients, nearest_on_border, twice_area

CHUNK = 4_000_000  # candidate texels that are looked at together; bounds the memory at about 300 MB
RING = 1.0  # [texel] how far outside a triangle its own plane is still continued, see `rasterize`


def texel_space(uv: np.ndarray, resolution: int) -> np.ndarray:
    """UVs (..., 2) as (column, row), float64; texel centres are at the integers."""
    flipped = np.stack([uv[..., 0], 1.0 - uv[..., 1].astype(np.float64)], axis=-1)
    return flipped * resolution - 0.5


def texels_in_boxes(
    low: np.ndarray, high: np.ndarray, chunk: int = CHUNK
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yields (face, column, row) of the texels in each face's box, about `chunk` texels at a time.

    Args:
        low, high: (F, 2) int64 first and last (column, row); a face is left out where `high` is below `low`.
        chunk: a box larger than that is cut between its rows.
    """
    size = np.maximum(high - low + 1, 0)
    for faces in _portions(size.prod(axis=1), chunk):
        of, row = _counted(size[faces, 1])
        strip = faces[of]
        for part in _portions(size[strip, 0], chunk):
            of, column = _counted(size[strip[part], 0])
            face = strip[part][of]
            yield face, column + low[face, 0], row[part][of] + low[face, 1]


def _portions(count: np.ndarray, chunk: int) -> Iterator[np.ndarray]:
    """Yields the indices of the positive counts in order, as many together as sum to about `chunk`."""
    index = np.flatnonzero(count)
    group = np.cumsum(count[index]) // chunk
    if len(index):
        yield from np.split(index, np.flatnonzero(np.diff(group)) + 1)


def _counted(count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index k repeated count[k] times, and the numbers 0 to count[k] - 1 beside it."""
    index = np.repeat(np.arange(len(count)), count)
    return index, np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)


def covered_texels(uv: np.ndarray, resolution: int) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yields the texels in each face's bounding box and a ring around it, several million at a time.

    Args:
        uv: (F, 3, 2), v upwards.
        resolution: N, side of the map [texels].

    Yields:
        (M,) faces, (M,) texels as row * N + column, and (M, 3) float32 barycentric coordinates of the texels'
        centres, negative outside the face.
    """
    p = texel_space(uv, resolution).astype(np.float32)
    area = twice_area(p)
    low = np.clip(np.ceil(p.min(axis=1) - RING), 0, resolution - 1).astype(np.int64)
    high = np.clip(np.floor(p.max(axis=1) + RING), 0, resolution - 1).astype(np.int64)
    high[np.abs(area) <= 1e-7] = -1
    # Affine in the texel: two gradients per face instead of three areas per texel.
    origin, gradient = barycentric_gradients(p, area)
    for face, column, row in texels_in_boxes(low, high):
        dx = column.astype(np.float32) - origin[face, 0]
        dy = row.astype(np.float32) - origin[face, 1]
        b1 = gradient[face, 0] * dx + gradient[face, 1] * dy
        b2 = gradient[face, 2] * dx + gradient[face, 3] * dy
        yield face, row * resolution + column, np.stack([1.0 - b1 - b2, b1, b2], axis=1)


def rasterize(uv: np.ndarray, resolution: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which face the texels in a chart, or within `RING` of it, show.

    A bilinear lookup at a chart's border also reads texels whose centres lie just outside. Those continue
    the nearest face linearly, which makes the lookup exact at the border; the continuation is limited to
    half an edge, for faces smaller than a texel.

    Args:
        uv: (F, 3, 2), v upwards.
        resolution: N, side of the map [texels].

    Returns:
        (N, N) int32 faces, -1 for none; (N, N, 3) float32 barycentric coordinates; (N, N) float32 distances
        from the centre to the face [texels], 0 inside and infinite where there is no face.
    """
    p = texel_space(uv, resolution).astype(np.float32)
    texels = resolution * resolution
    best = np.full(texels, np.inf, np.float32)
    face = np.full(texels, -1, np.int32)
    barycentric = np.zeros((texels, 3), np.float32)
    for candidate, texel, weight in covered_texels(uv, resolution):
        distance = _distance(p, candidate, texel, weight, resolution)
        keep = nearest_last(best, texel, np.where(distance <= RING * np.sqrt(2.0), distance, np.inf))
        best[texel[keep]] = distance[keep]
        face[texel[keep]] = candidate[keep]
        limited = np.maximum(weight[keep], -0.5)
        barycentric[texel[keep]] = limited / limited.sum(axis=1, keepdims=True)
    shape = (resolution, resolution)
    return face.reshape(shape), barycentric.reshape(*shape, 3), best.reshape(shape)


def nearest_last(best: np.ndarray, texel: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """The candidates nearer to their texels than the best so far, in the order in which to write them.

    The nearest of a texel is written last, and of equals the first.

    Args:
        best: (N,) distances of all texels so far.
        texel: (M,) of the candidates.
        distance: (M,).

    Returns:
        Indices into the candidates.
    """
    nearer = np.flatnonzero(distance < best[texel])[::-1]
    return nearer[np.argsort(-distance[nearer], kind="stable")]


def _distance(
    p: np.ndarray, face: np.ndarray, texel: np.ndarray, barycentric: np.ndarray, resolution: int
) -> np.ndarray:
    """Distance from texel centres to faces [texels], 0 inside, infinite when surely beyond the ring."""
    opposite = p[:, [2, 0, 1]] - p[:, [1, 2, 0]]  # the side opposite to each corner
    height = np.abs(twice_area(p))[:, None] / np.sqrt(np.maximum((opposite**2).sum(axis=2), 1e-20))
    outside = -(barycentric * height[face]).min(axis=1)
    distance = np.where(barycentric.min(axis=1) >= -1e-6, 0.0, np.inf).astype(np.float32)
    ring = np.flatnonzero((distance > 0) & (outside <= 1.5 * RING))
    points = np.stack([texel[ring] % resolution, texel[ring] // resolution], axis=1).astype(np.float32)
    distance[ring] = nearest_on_border(p[face[ring]], points)[1]
    return distance
