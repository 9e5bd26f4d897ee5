"""Neural style fields: from a place on a mesh to its colour and offset (Michel et al. 2022, section 3.1)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch
import torch.nn.functional as F

Weights = Mapping[str, torch.Tensor]

TRUNK, HEAD = 5, 2  # hidden layers


@dataclass(frozen=True)
class Layers:
    """Linear layers in a row, each followed by max(0, x), and by layer normalisation if wanted.

    Attributes:
        name: under which their weights are.
        sizes: of what goes in and comes out, from the first to the last.
        head: whether the last layer is linear alone, and begins as zero.
        normalised: whether what each layer but that gives is normalised.
    """

    name: str
    sizes: tuple[int, ...]
    head: bool = False
    normalised: bool = False

    def weights(self, generator: torch.Generator) -> dict[str, torch.Tensor]:
        """Weights and biases as PyTorch's layers begin with."""
        weights = {}
        for k, (inputs, outputs) in enumerate(zip(self.sizes, self.sizes[1:], strict=False)):
            weight, bias, gain, shift = self._names(k)
            if self._is_last(k):
                weights |= {weight: torch.zeros(outputs, inputs), bias: torch.zeros(outputs)}
                continue
            bound = inputs**-0.5
            for name, shape in ((weight, (outputs, inputs)), (bias, (outputs,))):
                weights[name] = torch.empty(shape).uniform_(-bound, bound, generator=generator)
            if self.normalised:
                weights |= {gain: torch.ones(outputs), shift: torch.zeros(outputs)}
        return weights

    def __call__(self, weights: Weights, values: torch.Tensor) -> torch.Tensor:
        """(N, last size) of values (N, first size)."""
        for k in range(len(self.sizes) - 1):
            weight, bias, gain, shift = self._names(k)
            values = F.linear(values, weights[weight], weights[bias])
            if self._is_last(k):
                break
            values = F.relu(values)
            if self.normalised:
                values = F.layer_norm(values, values.shape[1:], weights[gain], weights[shift])
        return values

    def _is_last(self, k: int) -> bool:
        return self.head and k == len(self.sizes) - 2

    def _names(self, k: int) -> tuple[str, ...]:
        return tuple(f"{self.name}.{k}.{part}" for part in ("weight", "bias", "gain", "shift"))


def trunk(frequencies: int, width: int, normalised: bool = False) -> Layers:
    """What reads `encoded` places."""
    return Layers("trunk", (2 * frequencies + 3, *[width] * TRUNK), normalised=normalised)


def head(name: str, width: int, channels: int, normalised: bool = False) -> Layers:
    """What makes `channels` numbers of the trunk's features; all are zero at first."""
    return Layers(name, (*[width] * (HEAD + 1), channels), head=True, normalised=normalised)


def random_waves(frequencies: int, sigma: float, generator: torch.Generator) -> torch.Tensor:
    """(M, 3) waves, normally distributed [cycles a unit of the places]."""
    return sigma * torch.randn(frequencies, 3, generator=generator)


def encoded(points: torch.Tensor, waves: torch.Tensor, weights: torch.Tensor | None = None) -> torch.Tensor:
    """(N, 2 M + 3): the places (N, 3), and cosines and sines of waves (M, 3), by weight (M,) if given."""
    phase = 2 * math.pi * points @ waves.T
    sides = torch.cat([phase.cos(), phase.sin()], 1)
    return torch.cat([points, sides if weights is None else sides * weights.repeat(2)], 1)


def opened(waves: torch.Tensor, share: float) -> torch.Tensor:
    """(M,) weights from 0 to 1 of waves (M, 3); a share is open, the slowest first (Hertz et al. 2021).

    Args:
        waves: [cycles a unit of the places].
        share: 0 for none, 1 for all of them.
    """
    rank = waves.norm(dim=1).argsort().argsort()
    return (share * len(waves) - rank).clamp(0, 1)


def colours(values: torch.Tensor) -> torch.Tensor:
    """sRGB in (0, 1) of a head's values, grey where these are zero."""
    return 0.5 + 0.5 * values.tanh()
