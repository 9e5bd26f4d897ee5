"""Levels on disk: found once for a mesh, a layout and the options, then memory-mapped."""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from mitex.methods.surface.levels import Level, Levels
from mitex.paths import cache_dir

VERSION = "2"  # to be raised when levels are found in another way


def content_key(*parts: object) -> str:
    """A hash of arrays (dtype, shape and content) and of anything else by its `repr`."""
    digest = hashlib.sha256(VERSION.encode())
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(repr((part.dtype.str, part.shape)).encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
    return digest.hexdigest()[:32]


def cached_levels(key: str, find: Callable[[], Levels], folder: Path | None = None) -> Levels:
    """The levels kept under `key`, else those that `find` finds, which are kept then.

    A cache that cannot be read or written is no error: the levels are found again.

    Args:
        key: of the content, from `content_key`.
        find: the precomputation.
        folder: where the cache is; the user's cache folder if None.
    """
    place = (cache_dir() / "surface" if folder is None else folder) / key
    with suppress(OSError, ValueError, KeyError):
        return _read(place)
    levels = find()
    with suppress(OSError):
        _write(place, levels)
    return levels


def _read(place: Path) -> Levels:
    def array(name: str) -> np.ndarray:
        return np.load(place / f"{name}.npy", mmap_mode="c", allow_pickle=False)

    count = len(list(place.glob("taps*.npy")))
    if not count:
        raise KeyError(place)
    levels = tuple(Level(array(f"taps{n}"), array(f"sizes{n}")) for n in range(count))
    order = array("order")

    def matrix(name: str, rows: int) -> csr_array:
        parts = tuple(array(f"{name}_{part}") for part in ("data", "indices", "indptr"))
        return csr_array(parts, shape=(rows, len(order)))

    spread = matrix("spread", len(array("spread_indptr")) - 1)
    return Levels(order, matrix("lookup", 9 * len(order)), spread, levels)


def _write(place: Path, levels: Levels) -> None:
    """All files appear together: the folder is filled under another name and renamed."""
    place.parent.mkdir(parents=True, exist_ok=True)
    filling = Path(tempfile.mkdtemp(prefix=".filling-", dir=place.parent))
    try:
        arrays = {"order": levels.order}
        for name, matrix in (("lookup", levels.lookup), ("spread", levels.spread)):
            arrays |= {f"{name}_{part}": getattr(matrix, part) for part in ("data", "indices", "indptr")}
        for n, level in enumerate(levels.levels):
            arrays |= {f"taps{n}": level.taps, f"sizes{n}": level.sizes}
        for name, values in arrays.items():
            np.save(filling / f"{name}.npy", values, allow_pickle=False)
        shutil.rmtree(place, ignore_errors=True)  # a damaged one
        os.rename(filling, place)
    finally:
        shutil.rmtree(filling, ignore_errors=True)
