"""Convolutions whose weights never change, evaluated fast on a CPU.

Three savings over an ordinary network under autograd: bfloat16 where the CPU multiplies it natively,
channels last throughout, and the gradient with respect to the input as one more forward convolution (with
flipped, transposed weights), so that no weight gradient is ever formed. The whole stack is one autograd
node: taps (feature maps, or samples of them) add their gradient to the map that is flowing back, in place.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import torch
import torch.nn.functional as F

GRAM_ROWS = 8192  # feature vectors that are multiplied at a time


class Operation(Protocol):
    """A step of a frozen network.

    Attributes:
        needs_input: whether `backward` is given the operation's input instead of its output.
    """

    needs_input: bool

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """The operation's output; the input is not changed."""
        ...

    def backward(self, gradient: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
        """The gradient of the input, from that of the output, which may be overwritten."""
        ...


class FrozenConv:
    """A 3x3 convolution with bias and ReLU; weights (O, I, 3, 3).

    The product runs in the input's `dtype`; output and gradient are of `output_dtype`.
    """

    needs_input = False

    def __init__(
        self, weight: torch.Tensor, bias: torch.Tensor, dtype: torch.dtype, output_dtype: torch.dtype
    ) -> None:
        layout = torch.channels_last
        self.weight = weight.to(dtype).contiguous(memory_format=layout)
        self.bias, self.output_dtype = bias.to(dtype), output_dtype
        self.adjoint = weight.flip(2, 3).transpose(0, 1).to(output_dtype).contiguous(memory_format=layout)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return F.conv2d(x, self.weight, self.bias, padding=1).relu_().to(self.output_dtype)

    def backward(self, gradient: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
        """Input gradient (K, I, H, W); overwrites `gradient` with its part behind the ReLU."""
        torch.ops.aten.threshold_backward.grad_input(gradient, values, 0, grad_input=gradient)
        return F.conv2d(gradient, self.adjoint, padding=1)


class Pool:
    """2x2 pooling, stride 2; an odd last row or column is dropped."""

    needs_input = True

    def __init__(self, kind: str) -> None:
        self.kind = kind

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return F.avg_pool2d(x, 2) if self.kind == "average" else F.max_pool2d(x, 2)

    def backward(self, gradient: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
        if self.kind == "average":
            spread = F.interpolate(gradient, scale_factor=2.0, mode="nearest").mul_(0.25)
            missing = (values.shape[3] - spread.shape[3], values.shape[2] - spread.shape[2])
            return F.pad(spread, (0, missing[0], 0, missing[1])) if any(missing) else spread
        _, winners = F.max_pool2d(values, 2, return_indices=True)
        return torch.ops.aten.max_pool2d_with_indices_backward(
            gradient, values, [2, 2], [2, 2], [0, 0], [1, 1], False, winners
        )


@dataclass(frozen=True)
class Tap:
    """Where the stack is read: output of operation `index`, whole or at `positions` (K, n) of flat h * w."""

    index: int
    positions: torch.Tensor | None = None

    def read(self, x: torch.Tensor) -> torch.Tensor:
        """What the tap gives of the map x, float32 and its own memory."""
        if self.positions is None:
            return x.to(torch.float32, copy=True)  # the stack keeps its own, whatever the caller does
        return _rows(x)[_flat(self.positions, x)].float().view(*self.positions.shape, x.shape[1])

    def add(self, flowing: torch.Tensor, gradient: torch.Tensor, x: torch.Tensor) -> None:
        """Adds the gradient with respect to x, given that of `read`, to `flowing`."""
        if self.positions is None:
            flowing.add_(gradient)
            return
        gradient = gradient.reshape(-1, flowing.shape[1]).to(flowing.dtype)
        _shared_rows(flowing).index_add_(0, _flat(self.positions, flowing), gradient)


@dataclass(frozen=True)
class GramTap:
    """Gram matrices (regions, C, C) of the map's feature vectors, each divided by how many there are.

    Products are taken in the map's type and summed in float32, without a copy of the map: bfloat16 maps give
    it to 1e-3.

    Attributes:
        index: of the operation.
        regions: int64 indices of the vectors of each region; one region of all vectors if None.
    """

    index: int
    regions: Sequence[torch.Tensor] | None = None

    def read(self, x: torch.Tensor) -> torch.Tensor:
        rows = _rows(x)
        if self.regions is None:
            return _gram(rows.split(GRAM_ROWS), rows)[None]
        return torch.stack([_gram((rows[i] for i in r.split(GRAM_ROWS)), rows) for r in self.regions])

    def add(self, flowing: torch.Tensor, gradient: torch.Tensor, x: torch.Tensor) -> None:
        rows, total = _rows(x), _shared_rows(flowing)
        for weight, region in zip(gradient, self.regions or [None], strict=True):
            count = len(rows) if region is None else len(region)
            weight = ((weight + weight.t()) / count).to(x.dtype)
            if region is None:
                for whole, part in zip(total.split(GRAM_ROWS), rows.split(GRAM_ROWS), strict=True):
                    whole.addmm_(part, weight)
                continue
            for part in region.split(GRAM_ROWS):
                total.index_add_(0, part, rows[part] @ weight)


class FrozenStack(torch.autograd.Function):
    """Runs operations in turn and returns what the taps ask for; differentiable in the images only.

    Images (K, 3, H, W); a whole tap gives (K, C, h, w), a sampled one (K, n, C), a Gram tap (regions, C, C),
    float32 all. Operations on surfaces take and give (n, C) instead.
    """

    @staticmethod
    def forward(
        ctx: Any, images: torch.Tensor, operations: Sequence[Operation], taps: Sequence[Tap | GramTap]
    ) -> tuple[torch.Tensor, ...]:
        outputs, x = [], images
        for operation in operations:
            x = operation.forward(x)
            outputs.append(x)
        ctx.operations, ctx.taps, ctx.outputs = operations, taps, outputs
        ctx.set_materialize_grads(False)
        return tuple(tap.read(outputs[tap.index]) for tap in taps)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, *gradients: torch.Tensor | None) -> tuple[torch.Tensor | None, None, None]:
        outputs, flowing = ctx.outputs, None
        if outputs is None:
            raise RuntimeError("frozen features keep their maps for one backward pass only")
        for index in reversed(range(len(ctx.operations))):
            if flowing is None:
                flowing = torch.zeros_like(outputs[index])
            for tap, gradient in zip(ctx.taps, gradients, strict=True):
                if tap.index == index and gradient is not None:
                    tap.add(flowing, gradient, outputs[index])
            operation = ctx.operations[index]
            values = outputs[index - 1 if operation.needs_input else index]
            flowing = operation.backward(flowing, values)
            outputs[index] = None
        ctx.outputs = None
        return flowing.float() if flowing is not None else None, None, None


def _gram(parts: Iterable[torch.Tensor], rows: torch.Tensor) -> torch.Tensor:
    """(C, C) float32 mean outer product of the vectors (n, C) in some parts of `rows`."""
    total, count = torch.zeros(rows.shape[1], rows.shape[1], device=rows.device), 0
    for part in parts:
        total += part.t() @ part
        count += len(part)
    return total / count


def _rows(x: torch.Tensor) -> torch.Tensor:
    """(K, C, h, w) in channels-last memory as (K * h * w, C), sharing memory; (n, C) as it is."""
    return x if x.ndim == 2 else x.permute(0, 2, 3, 1).reshape(-1, x.shape[1])


def _flat(positions: torch.Tensor, x: torch.Tensor) -> torch.Tensor:
    if x.ndim == 2:
        return positions.reshape(-1)
    offsets = torch.arange(x.shape[0], device=x.device)[:, None] * (x.shape[2] * x.shape[3])
    return (positions + offsets).reshape(-1)


def _shared_rows(x: torch.Tensor) -> torch.Tensor:
    """`_rows`, for writing."""
    rows = _rows(x)
    if rows.data_ptr() != x.data_ptr():
        raise RuntimeError("a feature map left channels-last memory")
    return rows
