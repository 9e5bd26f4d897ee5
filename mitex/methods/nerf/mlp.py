"""Networks of linear layers without biases and ReLUs between them, on N points: (channels, N) arrays.

Inside Dr.Jit they are run by torch: on a CPU several times as fast as the products of `drjit.nn`. What is
between two layers has the channels of a point side by side in memory, where narrow matrices are multiplied
faster; and a part of the points goes through all layers while it is in a core's cache.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import torch

from mitex.methods.nerf.tensors import stacked, unstacked
from mitex.runtime.jit import dr, mi

T = TypeVar("T")
Weights = Sequence[torch.Tensor]
CHUNK = 2560  # points of a part
# In bfloat16 products are short work beside the calls that ask for them, and each new number of points costs
# as much as several products: oneDNN compiles for it.
LONG, GRAIN = 8192, 512  # points of a part there, and what their number is a multiple of
_pool = ThreadPoolExecutor(os.cpu_count(), initializer=torch.set_num_threads, initargs=(1,))
_relu_backward = torch.ops.aten.threshold_backward.grad_input


def on_threads(
    count: int, work: Callable[[Iterator[slice]], T], kind: torch.dtype = torch.float32
) -> list[T]:
    """What `work` finds on each of torch's threads, which share the parts of `count` points.

    Each thread could take as many of them; one that the machine holds up takes fewer.
    """
    threads = torch.get_num_threads()  # torch first counts them here: in the pool it would find one
    most, grain = (CHUNK, 1) if kind == torch.float32 else (LONG, GRAIN)
    whole = count - count % grain
    shares = threads * max(math.ceil(whole / threads / most), 1)
    size = max(math.ceil(whole / shares / grain), 1) * grain
    starts = [*range(0, whole, size), whole, count]
    parts = iter([slice(start, end) for start, end in itertools.pairwise(starts) if end > start])
    return list(_pool.map(work, [parts] * threads))


def kind_of(part: slice, kind: torch.dtype) -> torch.dtype:
    """What a part is multiplied in: `kind`, but for the rest that is no multiple of `GRAIN`."""
    return torch.float32 if (part.stop - part.start) % GRAIN else kind


def room(weights: Weights, count: int, kind: torch.dtype = torch.float32) -> list[torch.Tensor]:
    """Where `forwards` puts what it finds between the layers, of `count` points."""
    return [torch.empty(count, len(weight), dtype=kind).T for weight in weights[:-1]]


def forwards(
    weights: Weights, values: torch.Tensor, between: Weights, part: slice, out: torch.Tensor
) -> None:
    """Runs a network on a part of the points.

    Args:
        weights: (out, in) of each layer.
        values: inputs of the part.
        between: a `room` for all points; in bfloat16 it keeps, for gradients, what is exact here.
        part: which of them.
        out: where the outputs of the part go.
    """
    for weight, made in zip(weights[:-1], between, strict=True):
        kept = made[:, part]
        if kept.dtype == values.dtype:
            values = torch.mm(values.T, weight.T, out=kept.T).T.relu_()
        else:
            values = (values.T @ weight.T).T.relu_()
            kept.copy_(values)
    torch.mm(weights[-1], values, out=out)


def backwards(
    weights: Weights,
    values: torch.Tensor,
    between: Weights,
    part: slice,
    gradient: torch.Tensor,
    found: Weights,
) -> torch.Tensor:
    """The gradient of what the first layer makes, from that of the outputs.

    Args:
        weights, values, between, part: as of `forwards`; the first two of the gradient's type.
        gradient: of the outputs of the part.
        found: those of the weights are added to it, float32; none if empty.
    """
    for k in reversed(range(len(weights))):
        given = between[k - 1][:, part].to(gradient.dtype) if k else values
        if found:
            found[k].add_(gradient @ given.T)
        if k:
            gradient = (gradient.T @ weights[k]).T  # the same as weights[k].T @ gradient, but by points
            _relu_backward(gradient, given, 0, grad_input=gradient)
    return gradient


def weight_bound(shape: tuple[int, int]) -> float:
    """Of the uniform distribution that weights start from (Glorot and Bengio 2010)."""
    return math.sqrt(6 / sum(shape))


def packed_networks(*nets: Sequence[Any]) -> list[Any]:
    """Networks for cooperative vectors, of the matrices (out, in) of each."""
    made = []
    for weights in nets:
        layers: list[Any] = []
        for weight in weights:
            linear: Any = dr.nn.Linear(weight.shape[1], weight.shape[0], bias=False)
            linear.weights = weight
            layers += [linear, dr.nn.ReLU()]
        made.append(dr.nn.Sequential(*layers[:-1]))
    return list(dr.nn.pack(*made))


def network_rows(net: Any, values: list[Any]) -> list[Any]:
    """Evaluates a network on N points: from its input channels, (N,) each, to its output channels.

    Args:
        net: its matrices (out, in), or one of `packed_networks`.
        values: input channels.
    """
    if isinstance(net, dr.nn.Module):
        return list(net(dr.nn.CoopVec(*values)))
    return unstacked(evaluate(net, stacked(values)))


def evaluate(weights: Sequence[Any], values: Any) -> Any:
    """Outputs (M, N) for inputs (K, N), all `mi.TensorXf`; differentiable backwards."""
    return dr.custom(_Network, values, [*weights], dr.grad_enabled(weights))


class _Network(dr.CustomOp):
    def eval(self, values: Any, weights: list[Any], learning: bool) -> Any:
        self.weights, self.learning = [weight.torch() for weight in weights], learning
        self.values = values.torch()
        count = self.values.shape[1]
        self.between = room(self.weights, count)
        found = torch.empty(len(self.weights[-1]), count)

        def work(parts: Iterator[slice]) -> None:
            for part in parts:
                forwards(self.weights, self.values[:, part], self.between, part, found[:, part])

        on_threads(count, work)
        return mi.TensorXf(found)

    def backward(self) -> None:
        gradient: Any = self.grad_out()
        given = gradient.torch()
        of_values = torch.empty_like(self.values)

        def work(parts: Iterator[slice]) -> Weights:
            found = [torch.zeros_like(weight) for weight in self.weights if self.learning]
            for part in parts:
                values = self.values[:, part]
                flow = backwards(self.weights, values, self.between, part, given[:, part], found)
                torch.mm(self.weights[0].T, flow, out=of_values[:, part])
            return found

        found = on_threads(given.shape[1], work)
        self.set_grad_in("values", mi.TensorXf(of_values))
        if self.learning:
            self.set_grad_in("weights", [mi.TensorXf(f) for f in summed(found)])

    def name(self) -> str:
        return "network"


def summed(found: Sequence[Weights]) -> list[torch.Tensor]:
    """Over threads, what each of them found."""
    return [torch.stack(parts).sum(0) for parts in zip(*found, strict=True)]
