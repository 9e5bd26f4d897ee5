"""Latent features on the base shape (section 3.1.4), in hash grids.

The tables belong to whoever trains them, and come in with each call.
"""

from __future__ import annotations

from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field.hash_grid import HashGrid
from mitex.methods.nerf.field.networks import FEATURES, PHASES
from mitex.runtime.jit import mi


class Encoding:
    """Hash grids of f and f-hat over the scene cube [-1, 1]^3, looked up at foot points.

    Args:
        config: number, resolution and size of the levels.
    """

    def __init__(self, config: NerfConfig) -> None:
        extent = config.coarsest, config.finest, config.table
        self.grids = [HashGrid(channels // 2, *extent) for channels in (FEATURES, PHASES)]

    @property
    def sizes(self) -> list[int]:
        """Lengths of the tables of f and f-hat."""
        return [grid.size for grid in self.grids]

    def levels(self, which: int) -> list[slice]:
        """Where the levels lie in a table, 0 of f or 1 of f-hat."""
        return self.grids[which].levels

    def __call__(self, which: int, foot: mi.Point3f, table: mi.Float) -> list[mi.Float]:
        """Features at foot points, `mi.Point3f` in the cube: 0 for f (16 channels), 1 for f-hat (8)."""
        return self.grids[which](foot, table)
