"""The page's random numbers, with NumPy: the integer hash PCG, the places of cells, and the masks."""

import numpy as np

WORD = np.uint64(2**32 - 1)


def pcg(values: np.ndarray | int) -> np.ndarray:
    """Jarzynski and Olano (2020): uint32 to uint32, in uint64."""
    values = np.asarray(values).astype(np.uint64)
    state = (values * np.uint64(747796405) + np.uint64(2891336453)) & WORD
    word = (((state >> ((state >> np.uint64(28)) + np.uint64(4))) ^ state) * np.uint64(277803737)) & WORD
    return (word >> np.uint64(22)) ^ word


def places(count: int) -> np.ndarray:
    """The place of each vertex in the page's textures, (V,)."""
    slots = np.empty(count, np.int64)
    slots[np.argsort(pcg(np.arange(count)), kind="stable")] = np.arange(count)
    return slots


def mask(count: int, step: int, seed: int) -> np.ndarray:
    """Which cells update in a step, (V,) bool: those of tiles of 8 x 4 places, in rows of 256."""
    row, column = np.divmod(places(count), 256)
    tile = (row // 4 * 32 + column // 8).astype(np.uint64)
    return pcg((tile + pcg(np.uint64(step) + pcg(seed) & WORD)) & WORD) < 2**31
