"""The resolutions of a surface network: which texels a convolution reads, and which ones pooling joins.

Level 0 are the texels; an element of level n + 1 is a group of elements of level n. Texels are numbered so
that every group of every level is a contiguous range: pooling is a sum over segments, and neighbours on the
surface are near in memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

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

    @property
    def nearest(self) -> csr_array:
        """(9 n, n) CSR float32: each tap reads its element."""
        size = self.taps.size
        entries = np.ones(size, np.float32), self.taps.ravel(), np.arange(size + 1, dtype=np.int32)
        return csr_array(entries, shape=(size, len(self.taps)))


@dataclass(frozen=True, eq=False)
class Levels:
    """All resolutions of a surface with N texels, n of which have values of their own.

    Attributes:
        order: (n,) int32, the number in `Texels` of each element of level 0.
        position: (n, 3) float32 of the elements of level 0 [mesh units].
        lookup: (9 n, n) CSR float32, the bilinear taps of the first convolution: row 9 i + k is tap k of i.
        spread: (N, n) CSR float32, the values of all `Texels` from those of the elements.
        levels: level 0 first; `POOLS` of them, and more if coarser scales of the texture are looked at.
    """

    order: np.ndarray
    position: np.ndarray
    lookup: csr_array
    spread: csr_array
    levels: tuple[Level, ...]

    def groups(self, scale: int) -> np.ndarray:
        """(n,) int64, which element of level `scale` each element of level 0 is part of."""
        group = np.arange(len(self.order))
        for level in self.levels[:scale]:
            group = np.repeat(np.arange(len(level.sizes)), level.sizes)[group]
        return group

    @cached_property
    def positions(self) -> list[np.ndarray]:
        """(m, 3) positions of each level's elements, and of the last groups: means of those they join."""
        positions = [self.position]
        for level in self.levels:
            starts = np.cumsum(level.sizes) - level.sizes
            positions.append(np.add.reduceat(positions[-1], starts) / level.sizes[:, None])
        return positions
