"""Local coordinates: what the decoder is told of a point beside the state of the cells around it.

- `waves`: solid noise, cosines of the position along random directions, of a few cycles to an edge. They are
  the grain that the decoder shapes, and know nothing of triangles.
- `barycentrics`: sorted, each mapped through its distribution function (Cells2Pixels, appendix B): the
  published coordinates. Their derivatives jump at sides and medians.
- `polynomials`: the symmetric polynomials of the barycentrics, which are smooth across medians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import torch

from mitex.geometry.vectors import unit


@dataclass(frozen=True, eq=False)
class Waves:
    """Cosines of the position, in units of the edges around.

    Attributes:
        vectors: (N, 3) float32 [cycles per edge].
        phases: (N,) float32 [cycles].
        amplitude: of the cosines.
    """

    vectors: torch.Tensor
    phases: torch.Tensor
    amplitude: float

    @staticmethod
    def draw(count: int, frequencies: tuple[float, ...], amplitude: float, seed: int = 0) -> Waves:
        """`count` waves of random directions and phases, the frequencies [cycles per edge] in turns."""
        rng = np.random.default_rng(seed)
        lengths = np.resize(np.asarray(frequencies, np.float64), count)[:, None]
        vectors = lengths * unit(rng.normal(size=(count, 3)))
        phases = rng.random(count)
        return Waves(torch.from_numpy(vectors).float(), torch.from_numpy(phases).float(), amplitude)

    def repeating(self, period: float, edge: float) -> Waves:
        """The nearest waves that repeat after `period` along each axis, where edges are `edge` long."""
        octave = math.floor(math.log2(edge)) + 1  # the coarser one of the two that are mixed
        periods = period * 2.0**-octave
        return replace(self, vectors=(self.vectors * periods).round() / periods)

    def __call__(self, position: torch.Tensor, edge: torch.Tensor) -> torch.Tensor:
        """(P, N) values at positions (P, 3) where edges are `edge` (P,) long, in the same units.

        Between edges of different lengths, the waves of the two nearest powers of two are mixed: their
        phases could not follow a length that changes. Weights are such that the variance stays.
        """
        vectors, phases = self.vectors.to(position.device), self.phases.to(position.device)
        octave = torch.log2(edge)
        below = octave.floor()
        share = (octave - below)[:, None]
        mixed = position.new_zeros(len(position), len(vectors))
        for level, weight in ((below, 1 - share), (below + 1, share)):
            cycles = (position * torch.exp2(-level)[:, None]) @ vectors.T + phases
            mixed = mixed + weight.sqrt() * torch.cos(2 * math.pi * cycles)
        return self.amplitude * mixed


def sorted_barycentrics(barycentric: torch.Tensor) -> torch.Tensor:
    """(P, 3) in [-1, 1], each uniform over a triangle (Cells2Pixels, appendix B), of barycentrics (P, 3)."""
    ordered = barycentric.sort(1, descending=True).values
    bounds = ((1 / 3, 1.0, 1 / 2), (0.0, 1 / 2, 1 / 3), (0.0, 1 / 3, 0.0))
    return torch.stack([2 * _triangular(ordered[:, k], *bounds[k]) - 1 for k in range(3)], 1)


def symmetric_polynomials(barycentric: torch.Tensor) -> torch.Tensor:
    """(P, 2): 6 (ab + bc + ca) - 1 and 54 abc - 1, from -1 at the corners to 1."""
    a, b, c = barycentric.unbind(1)
    return torch.stack([6 * (a * b + b * c + c * a) - 1, 54 * a * b * c - 1], 1)


def _triangular(x: torch.Tensor, low: float, high: float, mode: float) -> torch.Tensor:
    """The distribution function of the triangular distribution."""
    above = 1 - (high - x) ** 2 / ((high - low) * (high - mode))
    if mode == low:
        return above
    return torch.where(x <= mode, (x - low) ** 2 / ((high - low) * (mode - low)), above)
