"""The space that the optimizer works in: the channels as they are, or the exemplar's principal components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from mitex.exemplar import Exemplar
from mitex.triples import Layout

TYPICAL_SPREAD = 0.15  # standard deviation of an exemplar's channels
MIN_SPREAD = 0.1  # of the largest: so much is left to directions in which the exemplar does not vary


@dataclass(frozen=True, eq=False)
class ColourSpace:
    """Affine coordinates of channel values: values = mean + coordinates @ basis.

    A step that is as long in all coordinates is long in the directions in which the exemplar varies and short
    in the others. Colours then change along those of the exemplar, and maps change together: features see
    little of a pixel's chroma, and steps in plain RGB leave coloured speckle there.

    Attributes:
        mean: (C,) float32.
        basis: (C, C) float32, invertible.
    """

    mean: torch.Tensor
    basis: torch.Tensor

    @staticmethod
    def of(exemplar: Exemplar, layout: Layout) -> ColourSpace:
        """Principal components of an exemplar's pixels, as long as their standard deviations."""
        size = sum(map(len, layout.values()))
        pixels = np.empty((size, np.prod(exemplar.size)))
        for name, channels in layout.items():
            pixels[list(channels)] = exemplar.maps[name].reshape(-1, len(channels)).T
        variance, directions = np.linalg.eigh(np.atleast_2d(np.cov(pixels)))
        spread = np.sqrt(np.maximum(variance, 0))
        spread = np.maximum(spread, max(MIN_SPREAD * spread.max(), 1e-3))
        basis = (directions * spread).T
        return ColourSpace(torch.from_numpy(pixels.mean(1)).float(), torch.from_numpy(basis).float())

    @staticmethod
    def plain(channels: int) -> ColourSpace:
        """The channels themselves."""
        return ColourSpace(torch.zeros(channels), torch.eye(channels))

    @staticmethod
    def around_grey(channels: int) -> ColourSpace:
        """The channels, seen from the middle of their range, of which nothing is known."""
        return ColourSpace(torch.full((channels,), 0.5), TYPICAL_SPREAD * torch.eye(channels))

    def values(self, coordinates: torch.Tensor) -> torch.Tensor:
        """Channel values (..., C) of coordinates (..., C)."""
        return coordinates @ self.basis + self.mean

    def coordinates(self, values: torch.Tensor) -> torch.Tensor:
        """Coordinates (..., C) of channel values (..., C)."""
        return (values - self.mean) @ torch.linalg.inv(self.basis)
