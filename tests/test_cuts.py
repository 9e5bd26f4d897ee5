"""Cuts against all paths there are."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import label

from mitex.cuts import (
    FEATHER,
    NO_CUT,
    cheapest_cut,
    cheapest_path,
    corner_paths,
    feather,
    new_part,
    overlap_paths,
)


def all_paths(length: int, width: int) -> list[tuple[int, ...]]:
    """Every sequence of columns with steps of at most one."""
    paths = product(range(width), repeat=length)
    return [path for path in paths if all(abs(a - b) <= 1 for a, b in zip(path, path[1:], strict=False))]


def cost(error: np.ndarray, path: np.ndarray | tuple[int, ...]) -> float:
    return float(error[np.arange(len(path)), list(path)].sum())


@pytest.mark.parametrize("closed", [False, True])
def test_cheapest_of_all_paths(closed: bool, rng: np.random.Generator):
    for _ in range(20):
        error = rng.random((6, 4)) ** 3
        candidates = [p for p in all_paths(6, 4) if not closed or abs(p[0] - p[-1]) <= 1]
        path = cheapest_path(error, closed)
        assert tuple(path) in candidates
        assert cost(error, path) == pytest.approx(min(cost(error, p) for p in candidates))


def test_closing_a_path_matters():
    """The free path goes from corner to corner; a closed one may not."""
    error = 1.0 - np.eye(5)
    assert list(cheapest_path(error)) == [0, 1, 2, 3, 4]
    closed = cheapest_path(error, closed=True)
    assert abs(closed[0] - closed[-1]) <= 1
    assert cost(error, closed) == 2.0


def test_top_path_ends_at_the_lower_border_of_its_strip(rng: np.random.Generator):
    for _ in range(20):
        error = rng.random((6, 6)) ** 3
        left, top = overlap_paths(error, 3, left=False, top=True)
        assert (left == NO_CUT).all()
        ends = [p for p in all_paths(6, 3) if p[-1] == 2]
        assert tuple(top) in ends
        assert cost(error[:3].T, top) == pytest.approx(min(cost(error[:3].T, p) for p in ends))


def test_left_path_alone_is_free(rng: np.random.Generator):
    error = rng.random((6, 6))
    left, top = overlap_paths(error, 3, left=True, top=False)
    assert (top == NO_CUT).all()
    assert cost(error, left) == pytest.approx(min(cost(error, p) for p in all_paths(6, 3)))


def best_corner(error: np.ndarray, width: int) -> float:
    """The smallest sum of a path up the left strip and one along the top strip that end in one cell."""
    size = len(error)
    turned = error.T
    best = np.inf
    for row, column in product(range(width), repeat=2):
        up = [p for p in all_paths(size - row, width) if p[0] == column]
        along = [p for p in all_paths(size - column, width) if p[0] == row and p[-1] == width - 1]
        if up and along:
            sums = min(cost(error[row:], p) for p in up), min(cost(turned[column:], p) for p in along)
            best = min(best, sum(sums) - float(error[row, column]))
    return best


def test_corner_is_the_cheapest_of_all(rng: np.random.Generator):
    for _ in range(20):
        error = rng.random((6, 6)) ** 3
        left, top = corner_paths(error, 3)
        row, column = int(top[0]), int(left[0])
        assert left[row] == column and top[column] == row
        assert (left[:row] == column).all() and (top[:column] == row).all()
        total = cost(error[row:], left[row:]) + cost(error.T[column:], top[column:]) - error[row, column]
        assert total == pytest.approx(best_corner(error, 3))


def pieces(mask: np.ndarray) -> int:
    labels: Any = label(mask, np.ones((3, 3)))
    return labels[1]


def test_corner_separates_old_from_new(rng: np.random.Generator):
    """The old is in one piece at the upper left, the new in one at the lower right."""
    for _ in range(50):
        new = new_part(*corner_paths(rng.random((32, 32)), 12))
        assert new[12:, 12:].all() and not new[0, 0] and not new[-1, 0] and not new[11, -1]
        assert pieces(new) == pieces(~new) == 1


def test_corner_follows_a_valley():
    """Along an L without error, the cut is that L."""
    error = np.ones((16, 16))
    error[3:, 2] = error[3, 2:12] = 0.0
    for k in range(4):  # down to the end of the strip
        error[min(3 + k, 5), 12 + k] = 0.0
    new = new_part(*corner_paths(error, 6))
    expected = np.zeros((16, 16), bool)
    expected[4:, 3:] = True
    for k in range(4):
        expected[: min(3 + k, 5) + 1, 12 + k] = False
    assert (new == expected).all()


def test_feather_is_a_ramp_across_the_seam():
    new = np.zeros((8, 20), bool)
    new[:, 10:] = True
    ramp = (np.arange(1, FEATHER)) / FEATHER
    weights = feather(new)
    assert np.allclose(weights[:, 8:12], ramp, atol=1e-6)
    assert np.allclose(weights[:, :8], 0.0) and np.allclose(weights[:, 12:], 1.0)
    assert np.allclose(feather(new, wrapped=True)[:, [-2, -1, 0, 1]], ramp[::-1], atol=1e-6)


def price(error: np.ndarray, new: np.ndarray) -> float:
    """Of a cut: the errors on both sides of its length."""
    total = 0.0
    for axis in (0, 1):
        pair = np.moveaxis(error, axis, 0)
        total += (pair[1:] + pair[:-1])[np.diff(np.moveaxis(new, axis, 0), axis=0) != 0].sum()
    return float(total)


def test_cheapest_of_all_cuts(rng: np.random.Generator):
    for _ in range(10):
        error = rng.random((3, 4)) ** 3
        old, new = np.zeros((2, 3, 4), bool)
        old[:, 0] = new[1, 3] = True
        result = cheapest_cut(error, old, new)
        assert not result[old].any() and result[new].all()
        free = np.flatnonzero(~(old | new))
        prices = []
        for choice in product((False, True), repeat=len(free)):
            cells = new.copy()
            cells.ravel()[free] = choice
            prices.append(price(error, cells))
        assert price(error, result) == pytest.approx(min(prices), abs=0.01 * error.max())


def test_a_cut_goes_around_what_is_new_along_the_valley():
    """What becomes new lies within a ring where both pictures agree."""
    y, x = np.mgrid[-20:21, -20:21]
    radius = np.hypot(x, y)
    error = (radius - 12.0) ** 2
    rim = np.maximum(np.abs(x), np.abs(y)) == 20
    new = cheapest_cut(error, rim, radius < 2)
    border = new ^ (radius < 12.5)
    assert new.sum() > 350 and (np.abs(radius[border] - 12) < 1.5).all()


def test_without_anything_old_all_is_new():
    nothing = np.zeros((4, 4), bool)
    assert cheapest_cut(np.zeros((4, 4)), nothing, nothing).all()
