"""Convolutions on faces, whatever the order of their neighbours (Hertz et al. 2020, section 3.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy

import torch
import torch.nn.functional as F

from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.features import CHANNELS, GUIDES

SLOPE = 0.2  # of LeakyReLU
EPS = 1e-5  # of the instance norm


class FaceNetwork:
    """Six face convolutions with instance norm and LeakyReLU in between; the last one is bare.

    A convolution is max over neighbours j of W [x_j, x], that is max_j(N x_j) + S x: N x is taken once for
    each face instead of three times (the same value, a third of the products). Biases before an instance norm
    would change nothing and are left out.

    If the relief has a direction, every convolution is of [x_j, g_j, x], where g_j is the direction as the
    side towards neighbour j sees it: so a network can tell neighbours along the direction from those across
    it, which the paper's cannot.

    Args:
        widths: channels of the hidden layers.
        outputs: channels of the last layer: 3 of a generator, 1 of a critic.
        generator: source of the first weights, uniform in +-1 / sqrt(inputs).
        directed: whether the faces have directions.

    Attributes:
        parameters: [side (4 + G, C1); across (C + G, C'), own (C, C') for each further layer; bias
            (outputs,)], where G is 2 if directed, else 0.
    """

    def __init__(
        self, widths: Sequence[int], outputs: int, generator: torch.Generator, directed: bool = False
    ) -> None:
        def uniform(inputs: int, *shape: int) -> torch.Tensor:
            values = torch.rand(shape, generator=generator) * 2 - 1
            return (values / math.sqrt(inputs)).requires_grad_()

        guides = GUIDES if directed else 0
        self.parameters = [uniform(CHANNELS + guides, CHANNELS + guides, widths[0])]
        for inputs, width in zip(widths, (*widths[1:], outputs), strict=True):
            every = 2 * inputs + guides
            self.parameters += [uniform(every, inputs + guides, width), uniform(every, inputs, width)]
        self.parameters.append(uniform(2 * widths[-1], outputs))

    def __call__(self, features: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
        """Features (..., F, 3, 4 + G) to (..., F, outputs)."""
        side, *layers, bias = self.parameters
        guides = features[..., CHANNELS:]
        x = (features @ side).amax(-2)
        for across, own in zip(layers[::2], layers[1::2], strict=True):
            x = F.leaky_relu(normalised(x), SLOPE)
            theirs, along = across.split([x.shape[-1], guides.shape[-1]])
            x = largest(x @ theirs, graph, guides @ along if guides.shape[-1] else None) + x @ own
        return x + bias

    def to(self, device: torch.device | str) -> FaceNetwork:
        """A network with the same parameters on another device."""
        moved = copy(self)
        moved.parameters = [p.detach().to(device).requires_grad_() for p in self.parameters]
        return moved

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


def largest(x: torch.Tensor, graph: FaceGraph, shift: torch.Tensor | None = None) -> torch.Tensor:
    """(..., F, C): for each face the largest value of its three neighbours, each channel by itself.

    The index of the largest comes first, so that all derivatives are one gather or scatter: four times as
    fast, both backward passes included, as torch's own derivative of a maximum.

    Args:
        x: (..., F, C).
        graph: of the F faces.
        shift: (..., F, 3, C) that is added to what is seen across each side.
    """
    with torch.no_grad():
        seen = [x.index_select(-2, graph.neighbours[:, k]) for k in range(3)]
        if shift is not None:
            seen = [value + shift[..., k, :] for k, value in enumerate(seen)]
        second, third = seen[1] > seen[0], seen[2] > torch.maximum(seen[0], seen[1])
        winner = _choice(second, third, *(graph.neighbours[:, k, None] for k in range(3)))
    result = x.gather(-2, winner)
    if shift is None:
        return result
    return result + _choice(second, third, *shift.unbind(-2))


def _choice(
    second: torch.Tensor, third: torch.Tensor, a: torch.Tensor, b: torch.Tensor, c: torch.Tensor
) -> torch.Tensor:
    """c where it is the third, else b where it is the second, else a."""
    return torch.where(third, c, torch.where(second, b, a))


def normalised(x: torch.Tensor) -> torch.Tensor:
    """Instance norm of (..., F, C): mean 0 and variance 1 over the faces, each channel by itself."""
    centred = x - x.mean(-2, keepdim=True)
    return centred * (centred.square().mean(-2, keepdim=True) + EPS).rsqrt()
