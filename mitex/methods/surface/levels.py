"""The resolutions of a surface network: which texels a convolution reads, and which ones pooling joins.

Level 0 are the texels; an element of level n + 1 is a group of elements of level n. Texels are numbered so
that every group of every level is a contiguous range: pooling is a sum over segments, and neighbours on the
surface are near in memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mitex.methods.surface.operations import Neighbourhood

POOLS = 5  # of VGG


@dataclass(frozen=True, eq=False)
class Level:
    """One resolution, n elements.

    Attributes:
        taps: (n, 9) int32, the element that each tap of a 3 x 3 kernel reads: rows of the image downwards,
            then columns to the right; tap 4 is the element itself.
        sizes: (m,) int32, how many successive elements each element of the next level joins.
    """

    taps: np.ndarray
    sizes: np.ndarray

    @cached_property
    def neighbourhood(self) -> Neighbourhood:
        """The taps and their transpose."""
        return Neighbourhood.of(self.taps)


@dataclass(frozen=True, eq=False)
class Levels:
    """All resolutions of N texels.

    Attributes:
        order: (N,) int32, the number in `Texels` of each element of level 0.
        index, weight: (N, 9, 4) int32 and float32, the bilinear taps of the first convolution.
        levels: level 0 first; `POOLS` of them, and more if coarser scales of the texture are looked at.
    """

    order: np.ndarray
    index: np.ndarray
    weight: np.ndarray
    levels: tuple[Level, ...]
