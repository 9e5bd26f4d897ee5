"""The network of Text2Mesh: from a place to a colour (Michel et al. 2022, section 3.1)."""

from __future__ import annotations

import math
from collections.abc import Mapping

import torch
import torch.nn.functional as F

TRUNK, HEAD = 5, 2  # hidden layers


def random_weights(frequencies: int, width: int, generator: torch.Generator) -> dict[str, torch.Tensor]:
    """Weights and biases as PyTorch's layers begin with; the last layer is zero, so that all is grey."""
    sizes = [2 * frequencies + 3, *[width] * (TRUNK + HEAD)]
    weights = {}
    for k, (inputs, outputs) in enumerate(zip(sizes, sizes[1:], strict=False)):
        bound = inputs**-0.5
        weights[f"weight{k}"] = torch.empty(outputs, inputs).uniform_(-bound, bound, generator=generator)
        weights[f"bias{k}"] = torch.empty(outputs).uniform_(-bound, bound, generator=generator)
    last = TRUNK + HEAD
    return weights | {f"weight{last}": torch.zeros(3, width), f"bias{last}": torch.zeros(3)}


def encoded(points: torch.Tensor, waves: torch.Tensor) -> torch.Tensor:
    """(N, 2 M + 3): the places (N, 3) [radii], and cosines and sines of waves (M, 3) [cycles a radius]."""
    phase = 2 * math.pi * points @ waves.T
    return torch.cat([points, phase.cos(), phase.sin()], 1)


def colours(weights: Mapping[str, torch.Tensor], points: torch.Tensor, waves: torch.Tensor) -> torch.Tensor:
    """(N, 3) sRGB in (0, 1) at places (N, 3) [radii]."""
    values = encoded(points, waves)
    for k in range(TRUNK + HEAD):
        values = F.relu(F.linear(values, weights[f"weight{k}"], weights[f"bias{k}"]))
    last = TRUNK + HEAD
    return 0.5 + 0.5 * F.linear(values, weights[f"weight{last}"], weights[f"bias{last}"]).tanh()
