"""The patches of a picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class PictureSource:
    """All patches of a picture whose corners lie on a grid; a `Source`.

    Attributes:
        image: (H, W, C) float32; all channels are compared.
        size: side of a patch, a multiple of 8, at most the picture's [px].
        stride: between the corners of patches [px].
    """

    image: np.ndarray
    size: int
    stride: int

    @cached_property
    def _corners(self) -> np.ndarray:
        """(P, 2) rows and columns."""
        rows, columns = (np.arange(0, side - self.size + 1, self.stride) for side in self.image.shape[:2])
        return np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=2).reshape(-1, 2)

    @property
    def centres(self) -> np.ndarray:
        """(P, 2) rows and columns of the patches' middles [px]."""
        return self._corners + 0.5 * (self.size - 1)

    @property
    def length(self) -> float:
        """Side of a patch [px]."""
        return float(self.size)

    @property
    def matched(self) -> int:
        """C."""
        return self.image.shape[2]

    def patch(self, index: int) -> np.ndarray:
        """(size, size, C) of the picture."""
        row, column = self._corners[index]
        return self.image[row : row + self.size, column : column + self.size]
