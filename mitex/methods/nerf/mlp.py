"""Networks of linear layers without biases and ReLUs between them, on N points: (channels, N) arrays.

Inside Dr.Jit they are run by torch: on a CPU several times as fast as the products of `drjit.nn`. What is
between two layers has the channels of a point side by side in memory, where narrow matrices are multiplied
faster.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch

from mitex.runtime import load_mitsuba

mi: Any = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (Mitsuba first: it decides which LLVM Dr.Jit opens)

Weights = Sequence[torch.Tensor]
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
    learning: bool = True,
    inputs: int | None = None,
) -> tuple[list[torch.Tensor], torch.Tensor]:
    """Gradients of weights and inputs.

    Args:
        weights: (out, in) of each layer.
        layers: of `forwards`.
        gradient: of the outputs.
        learning: False leaves the weights' out.
        inputs: how many of them need a gradient, from the first on; all if left out.
    """
    found = []
    for k in reversed(range(len(weights))):
        if learning:
            found.append(gradient @ layers[k].T)
        if k:
            gradient = _product(weights[k].T, gradient)
            _relu_backward(gradient, layers[k], 0, grad_input=gradient)
    return found[::-1], weights[0].T[:inputs] @ gradient


def _product(matrix: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
    """The same as `matrix @ values`, (M, N), but point by point in memory."""
    return (values.T @ matrix.T).T


def evaluate(weights: Sequence[Any], values: Any) -> Any:
    """Outputs (M, N) for inputs (K, N), all `mi.TensorXf`; differentiable backwards."""
    return dr.custom(_Network, values, [*weights], dr.grad_enabled(weights))


class _Network(dr.CustomOp):
    def eval(self, values: Any, weights: list[Any], learning: bool) -> Any:
        self.weights, self.learning = [weight.torch() for weight in weights], learning
        self.layers = forwards(self.weights, values.torch())
        return mi.TensorXf(self.layers[-1].contiguous())

    def backward(self) -> None:
        gradient: Any = self.grad_out()
        found, of_values = backwards(self.weights, self.layers, gradient.torch(), self.learning)
        self.set_grad_in("values", mi.TensorXf(of_values))
        if self.learning:
            self.set_grad_in("weights", [mi.TensorXf(f) for f in found])

    def name(self) -> str:
        return "network"
