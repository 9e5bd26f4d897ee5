"""Arrays that nobody can change: what a value is made of must not change below it."""

from __future__ import annotations

from typing import Any

import numpy as np


def constant(values: Any, dtype: Any) -> np.ndarray:
    """The values as a read-only array: a copy, unless they are one already or have been converted.

    Args:
        values: array, or what NumPy makes one of.
        dtype: of the result.

    Returns:
        A contiguous array. Nobody holds another view of its memory through which it could change.
    """
    array = np.ascontiguousarray(values, dtype)
    if _is_constant(array):
        return array
    return sealed(array if array is not values and array.flags.owndata else array.copy())


def sealed(array: np.ndarray) -> np.ndarray:
    """The same array, from now on read-only."""
    array.flags.writeable = False
    return array


def _is_constant(array: Any) -> bool:
    """Whether an array and all that it is a view of are read-only."""
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return False
        if array.base is None:
            return True
        array = array.base
    return False  # another library's memory
