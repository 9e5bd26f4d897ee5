"""A flat square whose opposite sides are joined: a texture on it repeats without a seam.

Its texels are pixels and its taps lie exactly on them, so that no geodesic is needed: what leaves the square
at a side comes in at the opposite one, on all levels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from mitex.errors import ConfigError
from mitex.mesh import grid
from mitex.methods.surface.config import SurfaceConfig
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.levels import POOLS, Level, Levels
from mitex.quilting.target import Target, TileTarget


@dataclass(frozen=True, eq=False)
class TileDomain(SurfaceDomain):
    """The square [-1, 1]^2 facing +z, whose UVs are the whole texture."""

    @staticmethod
    def flat(config: SurfaceConfig) -> TileDomain:
        """The domain that a synthesis with these settings works on.

        Raises:
            ConfigError: texels that cannot be pooled evenly, or an angle, for which taps would leave them.
        """
        depth = POOLS + config.scales
        if config.resolution % 2**depth:
            raise ConfigError(
                f"a tile of {config.resolution} texels cannot be halved {depth} times",
                f"use a multiple of {2**depth}, or fewer scales",
            )
        if config.angle:
            raise ConfigError(f"angle = {config.angle:g} of a tile", "leave it at 0")
        mesh = replace(grid(1, 1), name="tile")
        return TileDomain(mesh, config.resolution, config.frames, depth=depth)

    @cached_property
    def levels(self) -> Levels:
        """The levels of the network."""
        return tile_levels(self.resolution, self.depth)

    def target(self, patch: int) -> Target:
        """See `SurfaceDomain`."""
        return TileTarget(self.resolution, patch)


def tile_levels(side: int, depth: int) -> Levels:
    """Levels of side x side texels, a multiple of 2^depth, on the square [-1, 1]^2."""
    row, column = _blocks(side, depth)
    levels = tuple(_level(row[:: 4**n] >> n, column[:: 4**n] >> n, side >> n) for n in range(depth))
    x, y = (2 * column + 1) / side - 1, 1 - (2 * row + 1) / side
    order = row * side + column
    element = np.empty_like(order)
    element[order] = np.arange(len(order))
    spread = np.ones(len(order), np.float32), element, np.arange(len(order) + 1)
    return Levels(
        order=order.astype(np.int32),
        position=np.stack([x, y, 0 * x], axis=1).astype(np.float32),
        lookup=levels[0].nearest,
        spread=csr_array(spread),
        levels=levels,
    )


def _level(row: np.ndarray, column: np.ndarray, side: int) -> Level:
    """The level whose elements are the squares at (n,) rows and columns, of which there are side x side."""
    number = np.empty((side, side), np.int32)
    number[row, column] = np.arange(len(row))
    down, right = np.divmod(np.arange(9), 3)
    taps = number[(row[:, None] + down - 1) % side, (column[:, None] + right - 1) % side]
    return Level(taps, np.full(len(row) // 4, 4, np.int32))


def _blocks(side: int, depth: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of all texels, by blocks of 2^depth and in Morton order within them: groups of every
    level are contiguous.
    """
    row, column = np.divmod(np.arange(side * side), side)
    key = (row >> depth) * (side >> depth) + (column >> depth)
    for bit in reversed(range(depth)):
        key = key * 4 + ((row >> bit) & 1) * 2 + ((column >> bit) & 1)
    ranked = np.argsort(key)
    return row[ranked], column[ranked]
