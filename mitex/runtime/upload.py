"""Arrays of NumPy and tensors of torch as Dr.Jit's, with room behind them, and arrays where packets begin.

Dr.Jit takes over the memory of an array as it is, and its LLVM kernels read packets of 16 elements: past the
end of an array whose number of elements is no multiple of that. Embree reads vertices and faces as four
numbers instead of three, and so one past their end. What is read there does not matter. But where the array
ends at the end of a page and the next page is not mapped, as happens with large arrays once in a while, the
process ends with a segmentation fault (Dr.Jit 1.5, Mitsuba 3.9).

For an array that begins elsewhere than packets do, Dr.Jit makes another kernel. Those of NumPy begin here one
time and there the next: the kernels of one run would be of no use to the next, and take far longer than it.
"""

from __future__ import annotations

import mmap
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    import torch

A = TypeVar("A")
PACKET = 16  # elements
LINE = 64  # where packets begin, or smaller ones at multiples of their size [bytes]


def upload(kind: Callable[..., A], array: np.ndarray) -> A:
    """A Dr.Jit array or tensor of a kind such as `mi.Float`, of the values of a NumPy array.

    The memory is shared where it can be, as Dr.Jit's own constructors do: leave the array as it is.

    Args:
        kind: one-dimensional for arrays (N,), a tensor for others.
        array: of numbers, of a type that converts to that of the kind.
    """
    return kind(with_room(array))


def with_room(array: np.ndarray) -> np.ndarray:
    """The array, or a copy of it if it begins elsewhere than packets do, or if what is read past its end may
    be on the next page."""
    array = np.ascontiguousarray(array)
    start = array.__array_interface__["data"][0]
    if _past_line(array, start) == 0 and not _leaves_page(start, array.size, array.itemsize):
        return array
    roomy = np.empty(array.size + 2 * PACKET, array.dtype)
    first = -_past_line(roomy, roomy.__array_interface__["data"][0]) % PACKET
    copy = roomy[first : first + array.size].reshape(array.shape)
    copy[...] = array
    return copy


def _past_line(array: np.ndarray, start: int) -> int:
    """How many elements after the beginning of a packet an address is, rounded up."""
    return -(-(start % min(LINE, PACKET * array.itemsize)) // array.itemsize)


def tensor_with_room(tensor: torch.Tensor) -> torch.Tensor:
    """As `with_room` for a tensor on the CPU: a view of it or a copy, both with its gradient.

    Memory of torch's own begins where packets do; that of `torch.from_numpy` begins anywhere.
    """
    values = tensor.contiguous()
    if not _leaves_page(values.data_ptr(), values.numel(), values.element_size()):
        return values.view_as(values)
    roomy = values.new_empty(values.numel() + PACKET)
    roomy[: values.numel()] = values.flatten()
    return roomy[: values.numel()].view(values.shape)


def _leaves_page(start: int, count: int, itemsize: int) -> bool:
    """Whether what is read past an array, to the end of the packet there, is beyond its last byte's page."""
    last = start + count * itemsize - 1
    beyond = (count // PACKET + 1) * PACKET - count
    return count > 0 and last // mmap.PAGESIZE != (last + beyond * itemsize) // mmap.PAGESIZE
