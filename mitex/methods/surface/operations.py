"""Convolutions and poolings on the elements of a surface, with weights that never change.

A convolution gathers the nine elements of its taps and multiplies; the gradient with respect to its input is
the same with the adjoint weights, gathering for each element and tap the gradients of whoever read it there.
Both work in chunks small enough for the cache, so that the nine-fold map never exists.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import torch
import torch.nn.functional as F

from mitex.sparse import csr_tensor

CHUNK = 1 << 20  # gathered values that are multiplied at a time
LEAST_ROWS = 512  # elements in a chunk at least: each product reads all weights


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """The taps of a level and their transpose.

    Slot 9 j + k stands for element j being read through tap k. Most slots have one reader; those without one,
    and the further readers of the others, are listed.

    Attributes:
        taps: (n, 9), whom element i reads through tap k.
        reader: (n, 9), who reads element j through tap k.
        empty: (e,) slots without a reader, ascending.
        slot, further: (d,) slots, ascending, and their second, third, ... readers.
    """

    taps: torch.Tensor
    reader: torch.Tensor
    empty: torch.Tensor
    slot: torch.Tensor
    further: torch.Tensor

    @staticmethod
    def of(taps: np.ndarray) -> Neighbourhood:
        """The neighbourhood of taps (n, 9)."""
        slots = (taps.astype(np.int64) * 9 + np.arange(9)).ravel()
        ranked = np.argsort(slots, kind="stable")
        slots, readers = slots[ranked], (ranked // 9).astype(np.int32)
        first = np.concatenate([[True], slots[1:] != slots[:-1]])
        reader = np.full(taps.size, -1, np.int32)
        reader[slots[first]] = readers[first]
        empty = np.flatnonzero(reader < 0)
        reader[empty] = 0
        arrays = (taps.astype(np.int32), reader.reshape(-1, 9), empty, slots[~first], readers[~first])
        return Neighbourhood(*(torch.from_numpy(np.ascontiguousarray(a)) for a in arrays))


@dataclass(frozen=True, eq=False)
class Kernel:
    """The weights of a 3 x 3 convolution with I inputs and O outputs, tap by tap.

    Attributes:
        weight: (9 I, O).
        adjoint: (9 O, I), those of its transpose.
        bias: (O,).
    """

    weight: torch.Tensor
    adjoint: torch.Tensor
    bias: torch.Tensor

    @staticmethod
    def of(weight: torch.Tensor, bias: torch.Tensor, dtype: torch.dtype) -> Kernel:
        """The kernel of weights (O, I, 3, 3) and a bias (O,), for values of a type."""
        forward, back = (weight.permute(2, 3, *ends).flatten(0, 2).to(dtype) for ends in ((1, 0), (0, 1)))
        return Kernel(forward, back, bias.to(dtype))


class SurfaceConv:
    """A 3 x 3 convolution with bias and ReLU of values (n, I) on the elements of a level (equation 2).

    Args:
        kernel: of the values' type.
        around: whom each element reads.
    """

    needs_input = False

    def __init__(self, kernel: Kernel, around: Neighbourhood) -> None:
        self.weight, self.adjoint, self.bias, self.around = kernel.weight, kernel.adjoint, kernel.bias, around
        self.rows, self.back_rows = (_rows(len(weight) // 9) for weight in (self.weight, self.adjoint))
        # Where the chunks of the backward pass begin in the lists of irregular slots.
        starts = 9 * torch.arange(0, len(around.taps) + self.back_rows, self.back_rows)
        self.starts = [torch.searchsorted(slots, starts).tolist() for slots in (around.empty, around.slot)]

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        out = x.new_empty(len(x), len(self.bias))
        for into, which in zip(out.split(self.rows), self.around.taps.split(self.rows), strict=True):
            gathered = x.index_select(0, which.view(-1)).view(len(which), -1)
            torch.addmm(self.bias, gathered, self.weight, out=into)
            into.relu_()
        return out

    def backward(self, gradient: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
        torch.ops.aten.threshold_backward.grad_input(gradient, values, 0, grad_input=gradient)
        around = self.around
        out = gradient.new_empty(len(gradient), self.adjoint.shape[1])
        for k, into in enumerate(out.split(self.back_rows)):
            start = k * self.back_rows
            gathered = gradient.index_select(0, around.reader[start : start + self.back_rows].view(-1))
            empty, more = (slice(s[k], s[k + 1]) for s in self.starts)
            gathered.index_fill_(0, around.empty[empty] - 9 * start, 0)
            further = gradient.index_select(0, around.further[more])
            gathered.index_add_(0, around.slot[more] - 9 * start, further)
            torch.mm(gathered.view(len(into), -1), self.adjoint, out=into)
        return out


class BilinearConv:
    """The first convolution: its taps interpolate the texels (section 3.1); float32 in, `output_dtype` out.

    Args:
        kernel: float32.
        output_dtype: dtype of the output.
        lookup: (9 n, n) CSR, the shares that each tap reads; row 9 i + k is tap k of element i.
    """

    needs_input = False

    def __init__(self, kernel: Kernel, output_dtype: torch.dtype, lookup: scipy.sparse.csr_array) -> None:
        self.weight, self.bias, self.output_dtype = kernel.weight.t(), kernel.bias, output_dtype
        self.matrix, self.adjoint = csr_tensor(lookup), csr_tensor(lookup.T.tocsr())

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        taps = (self.matrix @ x).view(len(x), -1)
        return F.linear(taps, self.weight, self.bias).relu_().to(self.output_dtype)

    def backward(self, gradient: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
        torch.ops.aten.threshold_backward.grad_input(gradient, values, 0, grad_input=gradient)
        taps = gradient.float() @ self.weight
        return self.adjoint @ taps.view(9 * len(taps), -1)


class SurfacePool:
    """Pooling (n, C) -> (m, C) over successive elements, `sizes` (m,) of them each (section 3.2)."""

    needs_input = True

    def __init__(self, kind: str, sizes: np.ndarray) -> None:
        self.kind = kind
        self.sizes = torch.from_numpy(sizes.astype(np.int64))
        self.parent = torch.repeat_interleave(self.sizes)
        share = (1.0 / sizes).astype(np.float32).repeat(sizes)
        ends = np.concatenate([[0], np.cumsum(sizes)])
        shape = (len(sizes), len(share))
        self.mean = csr_tensor(scipy.sparse.csr_array((share, np.arange(len(share)), ends), shape=shape))
        self.share = torch.from_numpy(share)[:, None]

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        if self.kind == "average":
            return (self.mean @ x.float()).to(x.dtype)
        return torch.segment_reduce(x.float(), "max", lengths=self.sizes).to(x.dtype)

    def backward(self, gradient: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
        if self.kind == "average":
            return gradient.index_select(0, self.parent).mul_(self.share.to(gradient.dtype))
        best = values == self.forward(values).index_select(0, self.parent)
        equals = (self.mean @ best.float()) * self.sizes[:, None]  # a draw is shared
        return (gradient / equals).to(gradient.dtype).index_select(0, self.parent).mul_(best)


def _rows(channels: int) -> int:
    return max(CHUNK // (9 * channels), LEAST_ROWS)
