"""Levels on disk: found once for a mesh, a layout and the options, then memory-mapped."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from mitex.cache import cached
from mitex.methods.surface.levels import Level, Levels
from mitex.paths import cache_dir

VERSION = "3"  # part of the keys; to be raised when levels are computed in another way


def cached_levels(
    key: str, find: Callable[[], Levels], folder: Path | None = None, keep: bool = True
) -> Levels:
    """The levels kept under `key`, else those that `find` finds, which are kept then (`mitex.cache.cached`).

    Args:
        key: of the content.
        find: the precomputation.
        folder: where the cache is; the user's cache folder if None.
        keep: whether they are kept.
    """
    place = (cache_dir() / "surface" if folder is None else folder) / key
    return cached(place, find, _read, _write, keep)


def _read(place: Path) -> Levels:
    def array(name: str) -> np.ndarray:
        return np.load(place / f"{name}.npy", mmap_mode="c", allow_pickle=False)

    count = len(list(place.glob("taps*.npy")))
    levels = tuple(Level(array(f"taps{n}"), array(f"sizes{n}")) for n in range(count))
    order, position = array("order"), array("position")

    def matrix(name: str, rows: int) -> csr_array:
        parts = tuple(array(f"{name}_{part}") for part in ("data", "indices", "indptr"))
        return csr_array(parts, shape=(rows, len(order)))

    spread = matrix("spread", len(array("spread_indptr")) - 1)
    return Levels(order, position, matrix("lookup", 9 * len(order)), spread, levels)


def _write(folder: Path, levels: Levels) -> None:
    arrays = {"order": levels.order, "position": levels.position}
    for name, matrix in (("lookup", levels.lookup), ("spread", levels.spread)):
        arrays |= {f"{name}_{part}": getattr(matrix, part) for part in ("data", "indices", "indptr")}
    for n, level in enumerate(levels.levels):
        arrays |= {f"taps{n}": level.taps, f"sizes{n}": level.sizes}
    for name, values in arrays.items():
        np.save(folder / f"{name}.npy", values, allow_pickle=False)
