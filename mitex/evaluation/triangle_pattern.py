"""How much a texture shows the triangles of the mesh that it grew on."""

from __future__ import annotations

import numpy as np

SIDES = 6  # parts of a triangle's sides: places at the corners, on the sides and inside


def places(sides: int = SIDES) -> np.ndarray:
    """(L, 3) barycentric coordinates of a regular triangular grid on a triangle, its border included."""
    i, j = np.divmod(np.arange((sides + 1) ** 2), sides + 1)
    inside = i + j <= sides
    i, j = i[inside], j[inside]
    return np.stack([sides - i - j, i, j], axis=1).astype(np.float32) / sides


def triangle_share(values: np.ndarray) -> float:
    """The share of a texture's variance that is explained by the place within a triangle.

    A pattern that knows nothing of triangles has, over many of them, the same mean at every place. What
    differs repeats with the mesh: it is the energy at the mesh's own frequencies.

    Args:
        values: (F, L, C) on F triangles at the L `places`, corners in the order of the faces.

    Returns:
        The variance of the means of places that are alike under a change of corners, over the variance of
        all values; both summed over channels. About 1 / F by chance.
    """
    corners = np.sort(places(_sides(values.shape[1])), axis=1)
    _, kind = np.unique(corners.round(6), axis=0, return_inverse=True)
    kind = np.asarray(kind).ravel()
    count = np.bincount(kind)
    means = np.stack([values[:, kind == k].mean(axis=(0, 1)) for k in range(len(count))])
    centre = values.mean(axis=(0, 1))
    between = (count[:, None] * (means - centre) ** 2).sum() / len(kind)
    return float(between / max(float(values.var(axis=(0, 1)).sum()), 1e-20))


def _sides(count: int) -> int:
    return int(round((np.sqrt(8 * count + 1) - 3) / 2))
