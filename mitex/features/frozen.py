"""Convolutions whose weights never change, evaluated fast on a CPU.

Three savings over an ordinary network under autograd: bfloat16 where the CPU multiplies it natively,
channels last throughout, and the gradient with respect to the input as one more forward convolution (with
flipped, transposed weights), so that no weight gradient is ever formed. The whole stack is one autograd
node: taps (feature maps, or samples of them) add their gradient to the map that is flowing back, in place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
import torch.nn.functional as F


class FrozenConv:
    """A 3x3 convolution with bias and ReLU; weights (O, I, 3, 3).

    The product runs in the input's `dtype`; output and gradient are kept as `kept`.
    """

    def __init__(
        self, weight: torch.Tensor, bias: torch.Tensor, dtype: torch.dtype, kept: torch.dtype
    ) -> None:
        last = torch.channels_last
        self.weight = weight.to(dtype).contiguous(memory_format=last)
        self.bias, self.kept = bias.to(dtype), kept
        self.adjoint = weight.flip(2, 3).transpose(0, 1).to(kept).contiguous(memory_format=last)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return F.conv2d(x, self.weight, self.bias, padding=1).relu_().to(self.kept)

    def backward(self, gradient: torch.Tensor, output: torch.Tensor) -> torch.Tensor:
        """Input gradient (K, I, H, W); overwrites `gradient` with its part behind the ReLU."""
        torch.ops.aten.threshold_backward.grad_input(gradient, output, 0, grad_input=gradient)
        return F.conv2d(gradient, self.adjoint, padding=1)


class Pool:
    """2x2 pooling, stride 2; an odd last row or column is dropped."""

    def __init__(self, kind: str) -> None:
        self.kind = kind

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return F.avg_pool2d(x, 2) if self.kind == "average" else F.max_pool2d(x, 2)

    def backward(self, gradient: torch.Tensor, source: torch.Tensor) -> torch.Tensor:
        if self.kind == "average":
            spread = F.interpolate(gradient, scale_factor=2.0, mode="nearest").mul_(0.25)
            missing = (source.shape[3] - spread.shape[3], source.shape[2] - spread.shape[2])
            return F.pad(spread, (0, missing[0], 0, missing[1])) if any(missing) else spread
        _, winners = F.max_pool2d(source, 2, return_indices=True)
        return torch.ops.aten.max_pool2d_with_indices_backward(
            gradient, source, [2, 2], [2, 2], [0, 0], [1, 1], False, winners
        )


@dataclass(frozen=True)
class Tap:
    """Where the stack is read: output of operation `index`, whole or at `positions` (K, n) of flat h * w."""

    index: int
    positions: torch.Tensor | None = None


class FrozenStack(torch.autograd.Function):
    """Runs operations in turn and returns what the taps ask for; differentiable in the images only.

    Images (K, 3, H, W); a whole tap gives (K, C, h, w), a sampled one (K, n, C), float32 both.
    """

    @staticmethod
    def forward(ctx, images: torch.Tensor, operations: Sequence[FrozenConv | Pool], taps: Sequence[Tap]):
        outputs, x = [], images
        for operation in operations:
            x = operation.forward(x)
            outputs.append(x)
        ctx.operations, ctx.taps, ctx.outputs = operations, taps, outputs
        ctx.set_materialize_grads(False)
        return tuple(_read(outputs[tap.index], tap.positions) for tap in taps)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, *gradients):
        outputs, flowing = ctx.outputs, None
        if outputs is None:
            raise RuntimeError("frozen features keep their maps for one backward pass only")
        for index in reversed(range(len(ctx.operations))):
            if flowing is None:
                flowing = torch.zeros_like(outputs[index])
            for tap, gradient in zip(ctx.taps, gradients, strict=True):
                if tap.index == index and gradient is not None:
                    _add(flowing, gradient, tap.positions)
            operation = ctx.operations[index]
            if isinstance(operation, Pool):
                flowing = operation.backward(flowing, outputs[index - 1])
            else:
                flowing = operation.backward(flowing, outputs[index])
            outputs[index] = None
        ctx.outputs = None
        return flowing.float() if flowing is not None else None, None, None


def _rows(x: torch.Tensor) -> torch.Tensor:
    """(K, C, h, w) in channels-last memory as (K * h * w, C), sharing memory."""
    return x.permute(0, 2, 3, 1).reshape(-1, x.shape[1])


def _flat(positions: torch.Tensor, x: torch.Tensor) -> torch.Tensor:
    offsets = torch.arange(x.shape[0], device=x.device)[:, None] * (x.shape[2] * x.shape[3])
    return (positions + offsets).reshape(-1)


def _read(x: torch.Tensor, positions: torch.Tensor | None) -> torch.Tensor:
    if positions is None:
        return x.to(torch.float32, copy=True)  # the stack keeps its own, whatever the caller does
    return _rows(x)[_flat(positions, x)].float().view(*positions.shape, x.shape[1])


def _add(x: torch.Tensor, gradient: torch.Tensor, positions: torch.Tensor | None) -> None:
    if positions is None:
        x.add_(gradient)
        return
    rows = _rows(x)
    if rows.data_ptr() != x.data_ptr():
        raise RuntimeError("a feature map left channels-last memory")
    rows.index_add_(0, _flat(positions, x), gradient.reshape(-1, x.shape[1]).to(x.dtype))
