"""Conversions between NumPy arrays, Dr.Jit's arrays of C channels such as `mi.Point3f`, and its tensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar, cast

import numpy as np
import torch

from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

A = TypeVar("A", bound=dr.ArrayBase)


def tensor(values: dr.ArrayBase) -> mi.TensorXf:
    """A `mi.Float` as a `mi.TensorXf` (N,), an array of C of them as one (N, C)."""
    count = dr.width(values)
    if dr.depth_v(values) == 1:
        return mi.TensorXf(values, (count,))
    return mi.TensorXf(dr.ravel(values), (count, len(values)))


def channels(kind: type[A], values: np.ndarray) -> A:
    """Values (N, C) as a Dr.Jit array of a kind such as `mi.Point3f`; another N needs no other kernel."""
    return dr.unravel(kind, upload(mi.Float, np.ascontiguousarray(values, np.float32).ravel()))


def as_torch(values: mi.TensorXf) -> torch.Tensor:
    """The same memory as a torch tensor."""
    return cast(torch.Tensor, values.torch())


def rows(values: dr.ArrayBase) -> np.ndarray:
    """An array of C channels, each (N,), in memory: (N, C) float32."""
    return np.array(dr.ravel(values)).reshape(-1, len(values))


# Slicing a tensor compiles N into the kernel, so each N needs a new one. Where N is opaque, one kernel does.
def stack_rows(values: Sequence[mi.Float]) -> mi.TensorXf:
    """`mi.TensorXf` (C, N) whose rows are C arrays of width N or 1; those of width 1 are repeated."""
    count = max(dr.width(value) for value in values)
    flat = dr.zeros(mi.Float, count * len(values))
    for k, value in enumerate(values):
        wide = value if dr.width(value) == count else mi.Float(value) + dr.zeros(mi.Float, count)
        dr.scatter(flat, wide, row_places(k, count), mode=dr.ReduceMode.Permute)
    return mi.TensorXf(flat, (len(values), count))


def unstack_rows(tensor: mi.TensorXf) -> list[mi.Float]:
    """The C rows, each (N,), of a tensor (C, N)."""
    row_count, count = tensor.shape
    places = [row_places(k, count) for k in range(row_count)]
    return [dr.gather(mi.Float, tensor.array, place, mode=dr.ReduceMode.Permute) for place in places]


def row_places(k: int, count: int) -> mi.UInt32:
    """Where the elements of row k are in a flat tensor of rows of `count`."""
    return dr.arange(mi.UInt32, count) + dr.opaque(mi.UInt32, k * count)
