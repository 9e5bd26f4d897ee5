"""Which cells of the scene cube may hold matter: the others are skipped."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from scipy import ndimage

from mitex.methods.nerf.capture.capture import Capture, object_mask
from mitex.methods.nerf.capture.visual_hull import View, visual_hull
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload

WARMUP = 16  # refreshes of all cells; later ones are of half of them
DECAY = 0.95  # of the running maximum, for each refresh
CEILING = 10.0  # of the threshold [1 / scene units]


def hull_cells(capture: Capture, side: int) -> np.ndarray:
    """(side, side, side) bool, cells of the scene cube that the masks leave, and two layers around them."""
    lenses = zip(capture.images, capture.poses, capture.intrinsics, capture.distortion, strict=True)
    hull = visual_hull([View(object_mask(image), *camera) for image, *camera in lenses])
    if hull is None:
        return np.ones((side,) * 3, bool)
    centres = (np.arange(side) + 0.5) * (2 / side) - 1
    grid = np.stack(np.meshgrid(centres, centres, centres, indexing="ij"), axis=-1)
    in_hull = hull.contains(grid.reshape(-1, 3)).reshape((side,) * 3)
    return ndimage.binary_dilation(in_hull, iterations=2)


def sample_grid(density: Callable[[np.ndarray], np.ndarray], occupied: np.ndarray, side: int) -> np.ndarray:
    """(side, side, side) density at the centres of cells of the scene cube, x slowest; 0 where unoccupied.

    Args:
        density: of points (N, 3), (N,).
        occupied: (G, G, G) bool; `side` is a multiple of G.
        side: of the grid.
    """
    cell = np.repeat(np.arange(len(occupied)), side // len(occupied))  # that a sample is in
    grid = np.zeros((side,) * 3, np.float32)
    for x in range(side):  # in slabs, to save memory
        index = np.argwhere(occupied[cell[x]][np.ix_(cell, cell)])
        if len(index):
            place = np.insert(index, 0, x, axis=1)
            grid[x][tuple(index.T)] = density(((place + 0.5) * (2 / side) - 1).astype(np.float32))
    return grid


def packed_cells(occupied: np.ndarray) -> torch.Tensor:
    """(ceil(G^3 / 8),) uint8, one bit for each of the cells (G, G, G), as model files hold them."""
    return torch.from_numpy(np.packbits(occupied))


def unpacked_cells(packed: torch.Tensor, side: int) -> np.ndarray:
    """(side, side, side) uint8, the inverse of `packed_cells`.

    Raises:
        ValueError: they are of another grid.
    """
    if packed.shape != (-(-(side**3) // 8),):
        raise ValueError("occupied cells of another grid")
    return np.unpackbits(packed.numpy(), count=side**3).reshape((side,) * 3)


class Occupancy:
    """A running maximum of the density in each cell, and where it is above the threshold.

    Args:
        side: cells along a side of the scene cube.
        possible: (side, side, side) bool, x slowest; the only cells that are sampled; None for all.
    """

    def __init__(self, side: int, possible: np.ndarray | None = None) -> None:
        self.side = side
        where = np.ones(side**3, bool) if possible is None else possible.ravel()
        self.cells = np.flatnonzero(where)
        self.values = torch.zeros(len(self.cells))
        self.refreshes = 0
        self._mask: mi.TensorXu8 | None = None

    @property
    def mask(self) -> mi.TensorXu8:
        """(side, side, side) `mi.TensorXu8` of 0 and 1; before the first refresh all possible cells."""
        if self._mask is None:
            self._mask = upload(mi.TensorXu8, self.occupied)
        return self._mask

    @property
    def occupied(self) -> np.ndarray:
        """(side, side, side) uint8, the same in memory."""
        flat = np.zeros(self.side**3, np.uint8)
        flat[self.cells] = 1 if not self.refreshes else self._occupied()
        return flat.reshape((self.side,) * 3)

    @property
    def share(self) -> float:
        """Of the cube's volume that is occupied."""
        count = len(self.cells) if not self.refreshes else int(self._occupied().sum())
        return count / self.side**3

    def refresh(self, density: Callable[[np.ndarray], np.ndarray], generator: torch.Generator) -> float:
        """Samples all cells at first, later at half of them: occupied ones and others by chance.

        `values` is a new tensor afterwards, so that an earlier `state` stays what it was.

        Args:
            density: of points (N, 3) in the cube, (N,) [1 / scene units].
            generator: of the places in the cells.

        Returns:
            Mean of `values`, not finite if a density was not [1 / scene units].
        """
        index = torch.arange(len(self.cells))
        if self.refreshes >= WARMUP:
            quarter = max(1, len(self.cells) // 4)
            others = torch.randint(len(self.cells), (quarter,), generator=generator)
            occupied = torch.from_numpy(np.flatnonzero(self._occupied()))
            if len(occupied) > quarter:
                occupied = occupied[torch.randint(len(occupied), (quarter,), generator=generator)]
            index = torch.unique(torch.cat([others, occupied]))
        self.values = self.values * DECAY
        values = torch.from_numpy(density(self._points(index, generator)))
        self.values[index] = torch.maximum(self.values[index], values)
        self.refreshes += 1
        self._mask = None
        return self.values.mean().item()

    def state(self) -> dict[str, torch.Tensor]:
        """What a resumed run needs."""
        return {"occupancy": self.values, "refreshes": torch.tensor(self.refreshes)}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        """Restores `state`.

        Raises:
            ValueError: it is of another grid.
        """
        if state["occupancy"].shape != self.values.shape:
            raise ValueError("an occupancy grid of another size")
        self.values, self.refreshes, self._mask = state["occupancy"], int(state["refreshes"]), None

    def _occupied(self) -> np.ndarray:
        values = self.values.numpy()
        return values > min(float(values.mean()), CEILING)

    def _points(self, index: torch.Tensor, generator: torch.Generator) -> np.ndarray:
        cell = self.cells[index.numpy()]
        corner = np.stack(np.unravel_index(cell, (self.side,) * 3), axis=1)
        offset = torch.rand(len(cell), 3, generator=generator).numpy()
        return ((corner + offset) * (2 / self.side) - 1).astype(np.float32)
