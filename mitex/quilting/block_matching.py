"""Which patch continues what is there, of any outline: patches are compared in blocks of texels."""

from __future__ import annotations

import numpy as np

from mitex.quilting.matching import BLOCK, Candidates, Source, centre


class BlockMatcher(Candidates):
    """Compares places on a surface with all patches.

    Args:
        source: at least one patch.

    Raises:
        ConfigError: there are no patches, they have an unfit shape, or a value is not finite.
    """

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self.cells = self.shape[0] // BLOCK
        count, channels = len(self.centres), source.matched
        blocks = np.empty((count * self.cells**2, channels), np.float32)
        for index in range(count):
            square = source.patch(index)[..., :channels]
            part = slice(index * self.cells**2, (index + 1) * self.cells**2)
            blocks[part] = block_means(square, BLOCK).reshape(-1, channels)
        # As in `Matcher`, differences lose the fewest digits around the mean.
        self._mean = blocks.mean(0)
        self._squares = centre(blocks, self._mean).reshape(count, -1)
        self._blocks = blocks.reshape(count, -1)

    def distances(self, shares: np.ndarray, values: np.ndarray) -> np.ndarray:
        """(P,) L2 distances to what is there.

        Args:
            shares: (S / 4, S / 4) in [0, 1], how much of a block is there: its weight.
            values: (S / 4, S / 4, C) its means, of the channels that are compared.
        """
        weights = shares.ravel().astype(np.float32)
        target = (values.reshape(len(weights), -1) - self._mean).astype(np.float32)
        weighted = weights[:, None] * target
        total = self._squares @ weights - 2.0 * (self._blocks @ weighted.ravel()) + (weighted * target).sum()
        return np.sqrt(np.maximum(total, 0.0))


def block_means(square: np.ndarray, block: int) -> np.ndarray:
    """(S / block, S / block, C) means of the blocks of a square (S, S, C)."""
    cells = len(square) // block
    return square.reshape(cells, block, cells, block, -1).mean((1, 3))
