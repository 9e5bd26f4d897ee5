"""Hash grids of learned features (Mueller et al. 2022)."""

from __future__ import annotations

import itertools
import math
from typing import Any

from drjit.hashgrid import HashGridEncoding  # noqa: E402

from mitex.methods.nerf.field.tensors import row_places
from mitex.runtime.jit import dr, mi

CHANNELS = 2  # of a level
PRIMES = 2654435761, 805459861  # for the second and the third axis


class HashGrid:
    """Features over the scene cube [-1, 1]^3.

    The table belongs to whoever trains it, and comes in with each call.

    Args:
        levels: their number.
        coarsest, finest: cells of the first and the last level along the cube; a geometric series between.
        size: binary logarithm of the entries of a level.
    """

    def __init__(self, levels: int, coarsest: int, finest: int, size: int) -> None:
        growth = math.log2(finest / coarsest) / max(levels - 1, 1)
        self.cells = [coarsest * 2.0 ** (growth * level) for level in range(levels)]
        self._grid: Any = HashGridEncoding(  # its stubs leave out `data`
            mi.Float,
            3,
            n_levels=levels,
            n_features_per_level=CHANNELS,
            hashmap_size=2**size,
            base_resolution=coarsest,
            per_level_scale=2.0**growth,
            align_corners=True,
            init_scale=0.0,
        )
        self._grid.data = None
        self._scale = mi.Float([cells - 1 for cells in self.cells])
        sides = [math.ceil(cells - 1) + 1 for cells in self.cells]
        self._side, self._first = mi.UInt32(sides), mi.UInt32(self._firsts[:-1])
        sizes = [b - a for a, b in itertools.pairwise(self._firsts)]
        self._dense = mi.Bool([side**3 <= size for side, size in zip(sides, sizes, strict=True)])
        self._mask = 2**size - 1

    @property
    def size(self) -> int:
        """Length of the table."""
        return self._grid.n_params

    @property
    def levels(self) -> list[slice]:
        """Where the levels lie in the table."""
        return [slice(CHANNELS * a, CHANNELS * b) for a, b in itertools.pairwise(self._firsts)]

    @property
    def _firsts(self) -> list[int]:
        return [self._grid.level_offset(level) for level in range(len(self.cells) + 1)]

    def __call__(self, points: mi.Point3f, table: mi.Float) -> list[mi.Float]:
        """Features at `mi.Point3f`s, two arrays for each level; a flat `mi.Float` is the table."""
        place = dr.clip(points * 0.5 + 0.5, 0, 1)  # beyond its unit cube the grid returns garbage
        if dr.grad_enabled(table):
            return self._level_by_level(place, table)
        self._grid.data = table
        features = list(self._grid(place))
        self._grid.data = None
        return features

    def _level_by_level(self, points: mi.Point3f, table: mi.Float) -> list[mi.Float]:
        """The same in one array over levels and points: the entries of a level stay in the cache.

        `drjit.hashgrid` goes point by point: with gradients that takes half as long again.
        """
        count, levels = dr.width(points), len(self.cells)
        index, width = dr.arange(mi.UInt32, count * levels), dr.opaque(mi.UInt32, count)
        level = index // width
        place = dr.gather(mi.Point3f, points, index - level * width) * dr.gather(mi.Float, self._scale, level)
        side, first = (dr.gather(mi.UInt32, values, level) for values in (self._side, self._first))
        dense = dr.gather(mi.Bool, self._dense, level)
        low = mi.Point3u(dr.floor(place))
        share = place - mi.Point3f(low)
        features = mi.Vector2f(0)
        for corner in itertools.product((0, 1), repeat=3):
            x, y, z = (low[k] + corner[k] for k in range(3))
            hashed = (x ^ y * PRIMES[0] ^ z * PRIMES[1]) & self._mask
            entry = first + dr.select(dense, x + side * (y + side * z), hashed)
            weight = math.prod(share[k] if corner[k] else 1 - share[k] for k in range(3))
            features = dr.fma(dr.gather(mi.Vector2f, table, entry), weight, features)
        dr.eval(features)  # at once, or each channel would be looked up alone
        rows = [(k, row_places(level, count)) for level in range(levels) for k in range(CHANNELS)]
        return [dr.gather(mi.Float, features[k], row, mode=dr.ReduceMode.Permute) for k, row in rows]
