"""Between (N, C) arrays in memory and Dr.Jit's arrays of C channels."""

from __future__ import annotations

from typing import Any

import numpy as np

from mitex.runtime import load_mitsuba

mi: Any = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (Mitsuba first: it decides which LLVM Dr.Jit opens)


def tensor(values: Any) -> Any:
    """`mi.TensorXf` (N,) of a `mi.Float`, (N, C) of an array of C of them."""
    count = dr.width(values)
    if dr.depth_v(values) == 1:
        return mi.TensorXf(values, (count,))
    return mi.TensorXf(dr.ravel(values), (count, len(values)))


def channels(kind: Any, values: np.ndarray) -> Any:
    """A Dr.Jit array such as `mi.Point3f` of values (N, C); N is no part of the kernel."""
    return dr.unravel(kind, mi.Float(np.ascontiguousarray(values, np.float32).ravel()))


def rows(values: Any) -> np.ndarray:
    """(N, C) float32 of an array of C channels."""
    return np.array(dr.ravel(values)).reshape(-1, len(values))
