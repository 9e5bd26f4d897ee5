"""Minimum-error cuts between overlapping pictures (Efros and Freeman 2001), by dynamic programming.

A path has one cell in every row and steps aside by at most one column from row to row; what is on it is old.

Squares are laid in raster order. Where the top strip of one ends on the right, the square of the row above
goes on, but that of the same row is not there yet: a path that ended halfway down would leave a straight,
uncut edge below its end. Top paths therefore end at the lower border of their strip.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

FEATHER = 5  # texels that a seam is averaged over
NO_CUT = -1  # the path of a side without an overlap: all is new
PRICES = 1000  # of the largest error, in units that flows are counted in


def cheapest_path(error: np.ndarray, closed: bool = False) -> np.ndarray:
    """The path of the smallest sum through an (L, W) error from its first row to its last.

    Args:
        error: not negative.
        closed: the last row is followed by the first again, as around a cylinder.

    Returns:
        (L,) int64 columns.
    """
    error = error.astype(np.float64)
    if not closed:
        costs = path_costs(error)
        return _backtrack(costs, int(costs[-1].argmin()))
    width = error.shape[1]
    start = np.where(np.eye(width, dtype=bool), error[0], np.inf)  # one problem for every first cell
    costs = path_costs(np.broadcast_to(error[:, None], (len(error), width, width)), start)
    step = np.abs(np.subtract.outer(np.arange(width), np.arange(width))) <= 1
    ends = np.where(step, costs[-1], np.inf)
    first, last = np.unravel_index(ends.argmin(), ends.shape)
    return _backtrack(costs[:, first], int(last))


def path_costs(error: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """(L, ..., W) sums along the cheapest path from the first row to every cell, that cell's own included.

    Args:
        error: (L, ..., W); the axes between are separate problems.
        start: (..., W) in place of the first row.
    """
    costs = np.empty(error.shape)
    costs[0] = error[0] if start is None else start
    around = np.full((*error.shape[1:-1], error.shape[-1] + 2), np.inf)
    for row in range(1, len(error)):
        around[..., 1:-1] = costs[row - 1]
        best = np.minimum(around[..., :-2], around[..., 2:])
        costs[row] = error[row] + np.minimum(best, around[..., 1:-1])
    return costs


def corner_paths(error: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray]:
    """The cut along the left and the top side of a square that overlaps others on both.

    One path comes up the left strip, one comes from the lower right end of the top strip, and they meet in a
    cell of the corner, so that their common sum is the smallest of all.

    Args:
        error: (S, S) squared differences.
        width: of the strips.

    Returns:
        (S,) columns of the left path and (S,) rows of the top path, for `new_part`. Beyond the cell where
        they meet they go straight on.
    """
    error = error.astype(np.float64)
    up = path_costs(error[::-1, :width])
    end = np.where(np.arange(width) == width - 1, error[:width, -1], np.inf)
    back = path_costs(error[:width, ::-1].T, end)
    corner = slice(None, -width - 1, -1)
    total = up[corner] + back[corner].T - error[:width, :width]
    row, column = (int(k) for k in np.unravel_index(total.argmin(), total.shape))
    size = len(error)
    left, top = np.full(size, column), np.full(size, row)
    left[row:] = _backtrack(up[: size - row], column)[::-1]
    top[column:] = _backtrack(back[: size - column], row)[::-1]
    return left, top


def overlap_paths(error: np.ndarray, width: int, left: bool, top: bool) -> tuple[np.ndarray, np.ndarray]:
    """The cut of a square (S, S) that overlaps others on the left, at the top, on both or on no side."""
    if left and top:
        return corner_paths(error, width)
    none = np.full(len(error), NO_CUT)
    if left:
        return cheapest_path(error[:, :width]), none
    if top:
        return none, _backtrack(path_costs(error[:width].T.astype(np.float64)), width - 1)
    return none, none


def new_part(left: np.ndarray, top: np.ndarray) -> np.ndarray:
    """(H, W) bool, what lies right of the left path (H,) and below the top path (W,)."""
    return (np.arange(len(top)) > left[:, None]) & (np.arange(len(left))[:, None] > top)


def feather(new: np.ndarray, wrapped: bool = False) -> np.ndarray:
    """(H, W) float32 weights of the new part with a ramp of `FEATHER` texels across its seam.

    Args:
        new: (H, W) bool.
        wrapped: the last column is followed by the first again.
    """
    down = uniform_filter1d(new.astype(np.float32), FEATHER, axis=0, mode="nearest")
    return uniform_filter1d(down, FEATHER, axis=1, mode="wrap" if wrapped else "nearest")


def _backtrack(costs: np.ndarray, column: int) -> np.ndarray:
    """(L,) columns of the cheapest path that ends in a cell of the last row."""
    path = np.empty(len(costs), np.int64)
    path[-1] = column
    for row in range(len(costs) - 2, -1, -1):
        low = max(column - 1, 0)
        column = low + int(costs[row, low : column + 2].argmin())
        path[row] = column
    return path


def cheapest_cut(error: np.ndarray, old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """The cheapest cut between cells that stay old and cells that become new (Kwatra et al. 2003).

    Args:
        error: (H, W) squared differences, finite and not negative; the cut pays the errors on both its sides.
        old: (H, W) bool, cells that stay.
        new: (H, W) bool, cells that do not; where both are true the cell becomes new.

    Returns:
        (H, W) bool, which cells become new.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    cells = error.size
    number = np.arange(cells).reshape(error.shape)
    one = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
    other = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
    price = error.ravel() / max(float(error.max()), np.finfo(np.float64).tiny)
    # Flows are whole numbers. A cut that costs nothing still pays for its length.
    capacity = np.rint(PRICES * (price[one] + price[other])).astype(np.int32) + 1
    stays, becomes = number[old & ~new], number[new]
    source, sink = np.full(len(stays), cells), np.full(len(becomes), cells + 1)
    tail = np.concatenate([one, other, source, becomes])
    head = np.concatenate([other, one, stays, sink])
    fixed = np.full(len(stays) + len(becomes), np.iinfo(np.int32).max // 2, np.int32)
    graph = csr_array((np.concatenate([capacity, capacity, fixed]), (tail, head)), shape=(cells + 2,) * 2)
    left = graph - maximum_flow(graph, cells, cells + 1).flow
    left.data[left.data < 0] = 0
    left.eliminate_zeros()
    reached = np.zeros(cells + 2, bool)
    reached[breadth_first_order(left, cells, return_predecessors=False)] = True
    return ~reached[:cells].reshape(error.shape)
