"""Convolutions on faces, whatever the order of their neighbours (Hertz et al. 2020, section 3.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
import torch.nn.functional as F

from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.features import CHANNELS

SLOPE = 0.2  # of LeakyReLU
EPS = 1e-5  # of the instance norm


class FaceNetwork:
    """Six face convolutions with instance norm and LeakyReLU in between; the last one is bare.

    A convolution is max over neighbours j of W [x_j, x], that is max_j(N x_j) + S x: N x is taken once for
    each face instead of three times (the same value, a third of the products). Biases before an instance norm
    would change nothing and are left out.

    Args:
        widths: channels of the hidden layers.
        outputs: channels of the last layer: 3 of a generator, 1 of a critic.
        generator: source of the first weights, uniform in +-1 / sqrt(inputs).

    Attributes:
        parameters: [side (4, C1); across, own (C, C') for each further layer; bias (outputs,)].
    """

    def __init__(self, widths: Sequence[int], outputs: int, generator: torch.Generator) -> None:
        def uniform(inputs: int, *shape: int) -> torch.Tensor:
            values = torch.rand(shape, generator=generator) * 2 - 1
            return (values / math.sqrt(inputs)).requires_grad_()

        self.parameters = [uniform(CHANNELS, CHANNELS, widths[0])]
        for inputs, width in zip(widths, (*widths[1:], outputs), strict=True):
            self.parameters += [uniform(2 * inputs, inputs, width), uniform(2 * inputs, inputs, width)]
        self.parameters.append(uniform(2 * widths[-1], outputs))

    def __call__(self, features: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
        """Features (..., F, 3, 4) to (..., F, outputs)."""
        side, *layers, bias = self.parameters
        x = (features @ side).amax(-2)
        for across, own in zip(layers[::2], layers[1::2], strict=True):
            x = F.leaky_relu(normalised(x), SLOPE)
            x = largest(x @ across, graph) + x @ own
        return x + bias

    def load(self, parameters: Sequence[torch.Tensor]) -> None:
        """Takes over other values of all parameters.

        Raises:
            ValueError: there are more or fewer, or one has another shape.
        """
        with torch.no_grad():
            for mine, theirs in zip(self.parameters, parameters, strict=True):
                if mine.shape != theirs.shape:  # `copy_` would broadcast
                    raise ValueError(f"a parameter of shape {tuple(theirs.shape)}, not {tuple(mine.shape)}")
                mine.copy_(theirs)


def largest(x: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
    """(..., F, C): for each face the largest value of its three neighbours, each channel by itself.

    The index of the largest comes first, so that all derivatives are one gather or scatter: four times as
    fast, both backward passes included, as torch's own derivative of a maximum.
    """
    with torch.no_grad():
        first, second, third = (graph.neighbours[:, k, None] for k in range(3))
        a, b, c = (x.index_select(-2, graph.neighbours[:, k]) for k in range(3))
        winner = torch.where(b > a, second, first)
        winner = torch.where(c > torch.maximum(a, b), third, winner)
    return x.gather(-2, winner)


def normalised(x: torch.Tensor) -> torch.Tensor:
    """Instance norm: mean 0 and variance 1 over the faces, each channel by itself."""
    centred = x - x.mean(-2, keepdim=True)
    return centred * (centred.square().mean(-2, keepdim=True) + EPS).rsqrt()
