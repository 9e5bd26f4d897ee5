"""Networks of linear layers without biases and ReLUs between them, on N points: (channels, N) arrays.

Inside Dr.Jit they are run by torch: on a CPU several times as fast as the products of `drjit.nn`. What is
between two layers has the channels of a point side by side in memory, where narrow matrices are multiplied
faster; and a part of the points goes through all layers while it is in a core's cache.
"""

from __future__ import annotations

import itertools
import math
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar, cast

import torch

from mitex.methods.nerf.field.tensors import as_torch, stack_rows, unstack_rows
from mitex.runtime.jit import dr, mi
from mitex.textures.variant import on_llvm, require_variant

T = TypeVar("T")
Weights = Sequence[torch.Tensor]
CHUNK = 2560  # points of a part
# In bfloat16 products are short work beside the calls that ask for them, and each new number of points costs
# as much as several products: oneDNN compiles for it.
LONG, GRAIN = 8192, 512  # points of a part there, and what their number is a multiple of
_relu_backward = torch.ops.aten.threshold_backward.grad_input


_starting = threading.Lock()


def _in_new_thread(call: Callable[[], T]) -> T:
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(call).result()


def _use_one_thread() -> None:
    """Makes torch use one thread in this one.

    `torch.set_num_threads` also says how many threads new threads of the program get; that is taken back,
    once torch has read it here.
    """
    with _starting:
        count = _in_new_thread(torch.get_num_threads)
        torch.set_num_threads(1)
        torch.get_num_threads()
        _in_new_thread(partial(torch.set_num_threads, count))


_pool = ThreadPoolExecutor(os.cpu_count(), initializer=_use_one_thread)


def on_threads(
    count: int, work: Callable[[Iterator[slice]], T], kind: torch.dtype = torch.float32
) -> list[T]:
    """Results of `work` on each of torch's threads, which share the parts of `count` points.

    A thread takes the next part when it is done with one: those that the machine holds up take fewer.

    Args:
        count: points.
        work: goes through an iterator of parts, which it shares with the other threads.
        kind: what is multiplied in; long parts in bfloat16, see `LONG`.
    """
    threads = torch.get_num_threads()  # torch first counts them here: in the pool it would find one
    most, grain = (CHUNK, 1) if kind == torch.float32 else (LONG, GRAIN)
    whole = count - count % grain
    part_count = threads * max(math.ceil(whole / threads / most), 1)
    size = max(math.ceil(whole / part_count / grain), 1) * grain
    starts = [*range(0, whole, size), whole, count]
    parts = iter([slice(start, end) for start, end in itertools.pairwise(starts) if end > start])
    return list(_pool.map(work, [parts] * threads))


def kind_of(part: slice, kind: torch.dtype) -> torch.dtype:
    """What a part is multiplied in: `kind`, or float32 where its length is no multiple of `GRAIN`."""
    return torch.float32 if (part.stop - part.start) % GRAIN else kind


def empty_activations(weights: Weights, count: int, kind: torch.dtype = torch.float32) -> list[torch.Tensor]:
    """Memory for what `forwards` computes between the layers, for `count` points: (out, count) each."""
    return [torch.empty(count, len(weight), dtype=kind).T for weight in weights[:-1]]


def forwards(
    weights: Weights, values: torch.Tensor, activations: Weights, part: slice, out: torch.Tensor
) -> None:
    """Runs a network on a part of the points.

    Args:
        weights: (out, in) of each layer.
        values: inputs of the part.
        activations: of all points, see `empty_activations`; those of the part are written. Where they are
            bfloat16, they are rounded for the gradients, and the outputs stay exact.
        part: which of them.
        out: where the outputs of the part go.
    """
    for weight, layer in zip(weights[:-1], activations, strict=True):
        outputs = layer[:, part]
        if outputs.dtype == values.dtype:
            values = torch.mm(values.T, weight.T, out=outputs.T).T.relu_()
        else:
            values = (values.T @ weight.T).T.relu_()
            outputs.copy_(values)
    torch.mm(weights[-1], values, out=out)


def backwards(
    weights: Weights,
    values: torch.Tensor,
    activations: Weights,
    part: slice,
    gradient: torch.Tensor,
    sums: Weights,
) -> torch.Tensor:
    """The gradient of the first layer's outputs, before the ReLU, from that of the network's outputs.

    Args:
        weights, values, activations, part: as of `forwards`; the first two of the gradient's type.
        gradient: of the outputs of the part.
        sums: gradients of the weights are added to it, float32; none if empty.
    """
    for k in reversed(range(len(weights))):
        inputs = activations[k - 1][:, part].to(gradient.dtype) if k else values
        if sums:
            sums[k].add_(gradient @ inputs.T)
        if k:
            gradient = (gradient.T @ weights[k]).T  # the same as weights[k].T @ gradient, but by points
            _relu_backward(gradient, inputs, 0, grad_input=gradient)
    return gradient


def weight_bound(shape: tuple[int, int]) -> float:
    """Largest initial weight of a matrix (out, in), drawn uniformly (Glorot and Bengio 2010)."""
    return math.sqrt(6 / sum(shape))


def packed_networks(*nets: Sequence[mi.TensorXf]) -> list[dr.nn.Module]:
    """Networks that are evaluated as cooperative vectors, given the matrices (out, in) of each.

    Raises:
        ConfigError: the variant is no llvm one; on graphics cards Dr.Jit packs half precision alone.
    """
    require_variant("a field of networks", on_llvm(), "an llvm one")
    modules = []
    for weights in nets:
        layers: list[dr.nn.Module] = []
        for weight in weights:
            linear: Any = dr.nn.Linear(weight.shape[1], weight.shape[0], bias=False)
            linear.weights = weight  # which the stubs leave out
            layers += [linear, dr.nn.ReLU()]
        modules.append(dr.nn.Sequential(*layers[:-1]))
    return list(cast(tuple[dr.nn.Module, ...], dr.nn.pack(*modules)))


def network_rows(net: Sequence[mi.TensorXf] | dr.nn.Module, values: list[mi.Float]) -> list[mi.Float]:
    """Evaluates a network on N points: from its input channels, (N,) each, to its output channels.

    Args:
        net: its matrices (out, in), or one of `packed_networks`.
        values: input channels.
    """
    if isinstance(net, dr.nn.Module):
        return list(net(dr.nn.CoopVec(*values)))
    return unstack_rows(evaluate(net, stack_rows(values)))


def evaluate(weights: Sequence[mi.TensorXf], values: mi.TensorXf) -> mi.TensorXf:
    """Outputs (M, N) for inputs (K, N), all `mi.TensorXf`; differentiable backwards."""
    return dr.custom(_Network, values, [*weights], dr.grad_enabled(weights))


class _Network(dr.CustomOp):
    """`evaluate`, run by torch."""

    def eval(self, values: mi.TensorXf, weights: list[mi.TensorXf], learning: bool) -> mi.TensorXf:
        self.weights, self.learning = [as_torch(weight) for weight in weights], learning
        self.values = as_torch(values)
        count = self.values.shape[1]
        self.activations = empty_activations(self.weights, count)
        outputs = torch.empty(len(self.weights[-1]), count)

        def work(parts: Iterator[slice]) -> None:
            for part in parts:
                forwards(self.weights, self.values[:, part], self.activations, part, outputs[:, part])

        on_threads(count, work)
        return mi.TensorXf(outputs)

    def backward(self) -> None:
        of_outputs = as_torch(mi.TensorXf(self.grad_out()))
        of_values = torch.empty_like(self.values)

        def work(parts: Iterator[slice]) -> Weights:
            sums = [torch.zeros_like(weight) for weight in self.weights if self.learning]
            for part in parts:
                values = self.values[:, part]
                flow = backwards(self.weights, values, self.activations, part, of_outputs[:, part], sums)
                torch.mm(self.weights[0].T, flow, out=of_values[:, part])
            return sums

        sums = on_threads(of_outputs.shape[1], work)
        self.set_grad_in("values", mi.TensorXf(of_values))
        if self.learning:
            self.set_grad_in("weights", [mi.TensorXf(s) for s in sum_over_threads(sums)])

    def name(self) -> str:
        return "network"


def sum_over_threads(sums: Sequence[Weights]) -> list[torch.Tensor]:
    """Totals of the sums of each thread."""
    return [torch.stack(parts).sum(0) for parts in zip(*sums, strict=True)]
