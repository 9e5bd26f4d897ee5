"""Regions: a surface cut into compact parts of equal numbers of elements."""

from __future__ import annotations

import numpy as np


def bisect(position: np.ndarray, count: int) -> list[np.ndarray]:
    """Cuts points into parts by halving them, again and again, across the direction of their largest spread.

    Each part is about as wide as it is long, in whatever order the points come.

    Args:
        position: (n, 3) points.
        count: number of parts, 1 to n.

    Returns:
        Ascending int64 indices of the points of each part; sizes differ by at most the number of halvings.
    """
    parts, pending = [], [(np.arange(len(position)), count)]
    while pending:
        index, count = pending.pop()
        if count == 1:
            parts.append(np.sort(index))
            continue
        centred = position[index] - position[index].mean(axis=0)
        axis = np.linalg.eigh(centred.T @ centred)[1][:, -1]
        first = round(len(index) * (count // 2) / count)
        ranked = index[np.argsort(centred @ axis, kind="stable")]
        pending += [(ranked[first:], count - count // 2), (ranked[:first], count // 2)]
    return parts
