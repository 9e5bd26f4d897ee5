"""Pairs of boxes that overlap: all of them, each once, as all against all tells."""

import numpy as np
import pytest

from mitex.mesh import box_tree
from mitex.mesh.box_tree import BoxTree, morton_codes


def tree_pairs(low, high, wanted) -> list[tuple[int, ...]]:
    """The pairs of a tree, the lower number first."""
    blocks = [np.sort(pairs, axis=1).tolist() for pairs in BoxTree(low, high, wanted).pairs()]
    return sorted(tuple(pair) for block in blocks for pair in block)


def brute_force(low, high, wanted) -> list[tuple[int, ...]]:
    touch = (low[:, None] <= high).all(2) & (low <= high[:, None]).all(2)
    touch &= wanted[:, None] | wanted
    return [tuple(pair) for pair in np.argwhere(np.triu(touch, 1)).tolist()]


@pytest.mark.parametrize("block", [3, 1 << 16])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 8, 9, 200])
@pytest.mark.parametrize("share", [1.0, 0.1])
def test_pairs_are_those_of_all_against_all(rng, monkeypatch, block, count, share):
    """Of boxes of many sizes, some of them one point."""
    monkeypatch.setattr(box_tree, "BLOCK", block)
    low = rng.uniform(-1, 1, (count, 3))
    high = low + rng.uniform(0, 1, (count, 1)) ** 4 * (rng.random((count, 1)) < 0.9)
    wanted = rng.random(count) < share
    pairs = brute_force(low, high, wanted)
    assert tree_pairs(low, high, wanted) == pairs
    assert count < 200 or len(pairs) > 20


def test_boxes_that_touch_count():
    low = np.array([[0.0, 0, 0], [1, 0, 0], [2.1, 0, 0]])
    assert tree_pairs(low, low + 1, np.ones(3, bool)) == [(0, 1)]


def test_boxes_in_one_place():
    low = np.zeros((5, 3))
    assert len(tree_pairs(low, low, np.ones(5, bool))) == 10


def test_codes_keep_neighbours_together():
    """Along a line they are its order; in a cube, an octant is a run."""
    line = np.linspace(-3, 5, 100)[:, None] * [[1.0, 1, 1]]
    assert (np.diff(morton_codes(line).astype(float)) > 0).all()
    grid = np.stack(np.meshgrid(*[np.arange(8.0)] * 3), axis=-1).reshape(-1, 3)
    octant = ((grid >= 4) * [1, 2, 4]).sum(1)[np.argsort(morton_codes(grid))]
    assert (np.diff(octant) != 0).sum() == 7
