"""Maps that repeat: what a look shows on a flat lattice whose opposite sides are joined."""

from __future__ import annotations

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.exemplar import MAPS
from mitex.geometry.normal_maps import decode, encode, of_slopes
from mitex.mesh import Lattice
from mitex.methods.nca.bake import CHUNK, GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.surface import EDGE, decoder_units
from mitex.methods.nca.look import Look
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.ranges import TILE_CELLS
from mitex.ranges import TEXELS


def flat_cells(cells: int, resolution: int) -> Lattice:
    """The lattice of an automaton for maps of a resolution; arguments and errors as of `NcaTexture.tile`."""
    for name, value, (low, high) in (("cells", cells, TILE_CELLS), ("pixels", resolution, TEXELS)):
        if not low <= value <= high:
            raise ConfigError(f"a tile of {value} {name} along a side", f"use {low} to {high}")
    return Lattice.of(cells)


def tile_maps(
    look: Look, state: torch.Tensor, lattice: Lattice, resolution: int, palette: Palette | None = None
) -> dict[str, np.ndarray]:
    """Maps (N, N, c) of a state (V, C) of the cells in a lattice's square, as of `NcaTexture.tile`."""
    sampled = SampledTile(look, state, lattice, palette)
    maps = {name: np.empty((resolution, resolution, MAPS[name]), np.float32) for name in look.maps}
    height = max(CHUNK // resolution, 1)
    for top in range(0, resolution, height):
        rows = np.arange(top, min(top + height, resolution))
        values = sampled.values(rows, np.arange(resolution), resolution)
        for name, columns in look.layout.items():
            channels = values[..., list(columns)]
            maps[name][rows] = _unit(channels) if name == "normal" else channels
    return maps


def relief_normals(height: np.ndarray, bound: float, lattice: Lattice) -> np.ndarray:
    """The normal map (N, N, 3) of a height map (N, N, 1) that goes on at its opposite sides.

    Args:
        height: in [0, 1], of a texture from words.
        bound: how far the height moves the surface at most [mean edges], as of `Displacement`.
        lattice: which the maps show.
    """
    offsets = bound * EDGE * decoder_units(lattice.mesh).scale * (2 * height[..., 0].astype(np.float64) - 1)
    across = 2 * lattice.columns / len(height)  # two pixels
    right = (np.roll(offsets, -1, 1) - np.roll(offsets, 1, 1)) / across
    up = (np.roll(offsets, 1, 0) - np.roll(offsets, -1, 0)) / across
    return of_slopes(np.stack([right, up], axis=-1))


class SampledTile:
    """A state on a lattice, read at pixels of the plane.

    Args:
        look: the decoder and the maps.
        state: (V, C) of the cells in the square.
        lattice: their places.
        palette: as of `GrownTexture`.
    """

    def __init__(
        self, look: Look, state: torch.Tensor, lattice: Lattice, palette: Palette | None = None
    ) -> None:
        self.lattice = lattice
        cells = Cells(lattice.mesh, 0, lattice.mesh)
        spread = state[torch.from_numpy(lattice.source)]
        scale = decoder_units(lattice.mesh).scale
        repeating = look.repeating(lattice.columns / scale, lattice.edge / scale)
        self.grown = GrownTexture(repeating, spread, cells, palette=palette)

    def values(self, rows: np.ndarray, columns: np.ndarray, resolution: int) -> np.ndarray:
        """Values (R, C, K) in [0, 1] at the centres of pixels, of which `resolution` are a period.

        Args:
            rows: (R,) integers, row 0 at the top of the square; any others are pixels beyond it.
            columns: (C,) integers, to the right.
            resolution: pixels in a period.
        """
        # Whole numbers, so that a pixel and its copies are evaluated at exactly the same place.
        y = 1 - (rows % resolution + 0.5) / resolution
        x = (columns % resolution + 0.5) / resolution
        points = np.stack(np.broadcast_arrays(x, y[:, None]), axis=2).reshape(-1, 2)
        return self.grown.values(*self.lattice.locate(points)).reshape(len(rows), len(columns), -1)


def _unit(encoded: np.ndarray) -> np.ndarray:
    """A normal map whose normals have length 1; its frame is that of the image."""
    axes = np.eye(3, dtype=np.float32)
    return encode(decode(encoded, *axes), *axes)
