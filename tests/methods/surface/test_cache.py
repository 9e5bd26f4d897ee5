"""Levels on disk."""

import numpy as np
import pytest

from mitex.methods.surface.cache import cached_levels
from tests.methods.surface.grids import grid_levels


@pytest.fixture(scope="module")
def levels():
    return grid_levels(32)


def unwanted():
    raise AssertionError("found again")


def test_levels_are_found_once(tmp_path, levels):
    calls = []
    first = cached_levels("key", lambda: calls.append(1) or levels, tmp_path)
    again = cached_levels("key", unwanted, tmp_path)
    assert first is levels and calls == [1]
    assert np.array_equal(again.order, levels.order)
    assert np.array_equal(again.position, levels.position)
    for a, b in ((again.lookup, levels.lookup), (again.spread, levels.spread)):
        assert a.shape == b.shape and abs(a - b).max() == 0
    assert len(again.levels) == len(levels.levels)
    for a, b in zip(again.levels, levels.levels, strict=True):
        assert np.array_equal(a.taps, b.taps) and np.array_equal(a.sizes, b.sizes)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["key"]


@pytest.mark.parametrize("damage", ["cut", "missing", "empty", "pickle"])
def test_a_damaged_cache_is_replaced(tmp_path, levels, damage):
    cached_levels("key", lambda: levels, tmp_path)
    file = tmp_path / "key" / "order.npy"
    if damage == "cut":
        file.write_bytes(file.read_bytes()[:-64])
    elif damage == "missing":
        file.unlink()
    elif damage == "empty":
        for path in (tmp_path / "key").iterdir():
            path.unlink()
    else:
        np.save(file, np.array([{}], object), allow_pickle=True)
    assert cached_levels("key", lambda: levels, tmp_path) is levels
    assert np.array_equal(cached_levels("key", unwanted, tmp_path).order, levels.order)


def test_no_place_for_a_cache_is_no_error(tmp_path, levels):
    (tmp_path / "file").touch()
    assert cached_levels("key", lambda: levels, tmp_path / "file") is levels
