"""Quilting: blocks of an exemplar in raster order, cut where they overlap (Efros and Freeman 2001)."""

from __future__ import annotations

import numpy as np
from numpy.fft import irfft2, rfft2

from mitex.cuts import feather, new_part, overlap_paths
from mitex.progress import announce

EVEN = 1e-6  # squared error a pixel that counts as none: blocks that fit exactly are not told apart


def quilt(
    exemplar: np.ndarray,
    size: int,
    block: int,
    overlap: int,
    rng: np.random.Generator,
    *,
    tolerance: float = 0.1,
    soft: bool = False,
) -> np.ndarray:
    """A picture of blocks of an exemplar.

    Args:
        exemplar: (H, W, C), at least as large as a block.
        size: side of the picture N [px].
        block: side of a block [px].
        overlap: with the blocks on the left and above [px], below `block`.
        rng: draws the first block, and those that follow among the best.
        tolerance: a block may be drawn whose squared error is up to 1 + tolerance times the smallest.
        soft: average across cuts.

    Returns:
        (N, N, C) float32.
    """
    stride = block - overlap
    places = range(0, max(size - overlap, 1), stride)
    extent = places[-1] + block
    picture = np.zeros((extent, extent, exemplar.shape[2]), np.float32)
    errors = OverlapErrors(exemplar, block, overlap)
    for top in places:
        announce("quilting the picture", top // stride, len(places))
        for left in places:
            old = picture[top : top + block, left : left + block]
            row, column = draw(errors(old, left > 0, top > 0), tolerance, rng)
            new = exemplar[row : row + block, column : column + block]
            _lay(old, new, overlap, left > 0, top > 0, soft)
    return picture[:size, :size]


def draw(errors: np.ndarray, tolerance: float, rng: np.random.Generator) -> tuple[int, int]:
    """Row and column of one of the smallest errors (H, W); all within the tolerance are as likely."""
    near = np.argwhere(errors <= (1 + tolerance) * errors.min())
    row, column = near[rng.integers(len(near))]
    return int(row), int(column)


class OverlapErrors:
    """How far all blocks of an exemplar are from what a place has already, by Fourier transforms.

    Args:
        exemplar: (H, W, C).
        block, overlap: [px].
    """

    def __init__(self, exemplar: np.ndarray, block: int, overlap: int) -> None:
        self.block, self.overlap = block, overlap
        self.valid = exemplar.shape[0] - block + 1, exemplar.shape[1] - block + 1
        self.shape = exemplar.shape[0], exemplar.shape[1]
        values = exemplar.astype(np.float64)
        self._spectrum = rfft2(values, self.shape, axes=(0, 1))
        squares = rfft2(np.square(values).sum(2), self.shape)
        sides = [(left, top) for left in (False, True) for top in (False, True)]
        self._squares = {side: self._correlated(squares, self.mask(*side).astype(float)) for side in sides}

    def mask(self, left: bool, top: bool) -> np.ndarray:
        """(B, B) bool, the pixels of a block that overlap others."""
        mask = np.zeros((self.block, self.block), bool)
        mask[:, : self.overlap * left] = True
        mask[: self.overlap * top] = True
        return mask

    def __call__(self, old: np.ndarray, left: bool, top: bool) -> np.ndarray:
        """(H - B + 1, W - B + 1) sums of squared differences over the overlaps with a place (B, B, C).

        All are as large as one another where nothing is overlapped.
        """
        mask = self.mask(left, top)
        known = np.where(mask[..., None], old, 0).astype(np.float64)
        products = self._correlated(self._spectrum, known)
        errors = self._squares[left, top] - 2 * products + np.square(known).sum()
        return np.maximum(errors, EVEN * max(int(mask.sum()), 1))

    def _correlated(self, spectrum: np.ndarray, template: np.ndarray) -> np.ndarray:
        """Correlation with a template (B, B) or (B, B, C), summed over the channels, at all whole blocks."""
        product = spectrum * rfft2(template, self.shape, axes=(0, 1)).conj()
        if product.ndim == 3:
            product = product.sum(2)
        rows, columns = self.valid
        return irfft2(product, self.shape)[:rows, :columns]


def _lay(old: np.ndarray, new: np.ndarray, overlap: int, left: bool, top: bool, soft: bool) -> None:
    """Lays a block (B, B, C) over what is there, in place, right of and below the cheapest cuts."""
    error = np.square(old - new).sum(2)
    mask = new_part(*overlap_paths(error, overlap, left=left, top=top))
    weights = mask.astype(np.float32)
    if soft:
        weights = feather(mask)
        # Beyond the overlap, nothing of what is there is meant to stay.
        weights[overlap * top :, overlap * left :] = 1.0
    weights = weights[..., None]
    old[:] = (1 - weights) * old + weights * new
