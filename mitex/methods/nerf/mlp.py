"""Networks of linear layers without biases and ReLUs between them, on N points: (channels, N) arrays.

Inside Dr.Jit they are run by torch: on a CPU several times as fast as the products of `drjit.nn`. What is
between two layers has the channels of a point side by side in memory, where narrow matrices are multiplied
faster.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import torch

from mitex.runtime import load_mitsuba

mi: Any = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (Mitsuba first: it decides which LLVM Dr.Jit opens)

Weights = Sequence[torch.Tensor]
CHUNK = 4096  # points whose values stay in a core's cache on their way back
_pool = ThreadPoolExecutor(os.cpu_count(), initializer=torch.set_num_threads, initargs=(1,))
_relu_backward = torch.ops.aten.threshold_backward.grad_input


def forwards(weights: Weights, values: torch.Tensor) -> list[torch.Tensor]:
    """What the layers read, and last the outputs, for inputs (K, N)."""
    layers = [values]
    for weight in weights[:-1]:
        layers.append(_product(weight, layers[-1]).relu_())
    return [*layers, _product(weights[-1], layers[-1])]


def backwards(
    weights: Weights,
    layers: Weights,
    gradient: torch.Tensor,
    learning: bool,
    of_inputs: torch.Tensor,
    inputs: slice = slice(None),
) -> list[torch.Tensor]:
    """Gradients of the weights.

    Args:
        weights: (out, in) of each layer.
        layers: of `forwards`.
        gradient: of the outputs.
        learning: False leaves the weights out.
        of_inputs: that of the inputs is added to it.
        inputs: which of them it has.
    """
    count = layers[0].shape[1]

    def work(starts: range) -> list[torch.Tensor]:
        found = [torch.zeros_like(weight) for weight in weights]
        for start in starts:
            part = slice(start, start + CHUNK)
            flow = gradient[:, part]
            for k in reversed(range(len(weights))):
                if learning:
                    found[k].addmm_(flow, layers[k][:, part].T)
                if k:
                    flow = _product(weights[k].T, flow)
                    _relu_backward(flow, layers[k][:, part], 0, grad_input=flow)
            of_inputs[:, part].addmm_(weights[0].T[inputs], flow)
        return found

    threads = torch.get_num_threads()
    shares = [range(k * CHUNK, count, threads * CHUNK) for k in range(threads)]
    found = list(_pool.map(work, shares))
    return [torch.stack(parts).sum(0) for parts in zip(*found, strict=True)] if learning else []


def _product(matrix: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
    """The same as `matrix @ values`, (M, N), but point by point in memory."""
    return (values.T @ matrix.T).T


def evaluate(weights: Sequence[Any], values: Any) -> Any:
    """Outputs (M, N) for inputs (K, N), all `mi.TensorXf`; differentiable backwards."""
    return dr.custom(_Network, values, [*weights], dr.grad_enabled(weights))


class _Network(dr.CustomOp):
    def eval(self, values: Any, weights: list[Any], learning: bool) -> Any:
        self.weights, self.learning = [weight.torch() for weight in weights], learning
        given = values.torch()
        self.layers = forwards(self.weights, given)
        found = self.layers[-1].contiguous()
        return mi.TensorXf(found)

    def backward(self) -> None:
        gradient: Any = self.grad_out()
        given = gradient.torch()
        of_values = torch.zeros_like(self.layers[0])
        found = backwards(self.weights, self.layers, given, self.learning, of_values)
        self.set_grad_in("values", mi.TensorXf(of_values))
        if self.learning:
            self.set_grad_in("weights", [mi.TensorXf(f) for f in found])

    def name(self) -> str:
        return "network"
