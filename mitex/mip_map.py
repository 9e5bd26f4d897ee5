"""Filtered lookup of images: a mip map (Williams 1983), read all over a pixel's footprint.

A pixel that covers many texels shows their mean; one texel in its place is noise. A single read of a mip map
blurs, 1.7 times as wide as the box of a pixel: here several reads of finer levels fill the footprint.
"""

from __future__ import annotations

import numpy as np

FINER = 4  # reads along the shorter extent of a footprint
READS = 64  # along each side of a footprint, at most
PIXELS = 256  # read at once
TOLERANCE = 1e-3  # of a read: rounding adds none to a footprint of one texel


class MipMap:
    """An image that repeats beyond its borders, with its means over ever larger squares.

    Args:
        image: (H, W, C), row 0 on top. Means are those of its values: give linear ones for means of light.

    Attributes:
        levels: the image, then halves of the one before, down to one texel.
    """

    def __init__(self, image: np.ndarray) -> None:
        self.levels = [np.asarray(image, np.float64)]
        while max(self.levels[-1].shape[:2]) > 1:
            self.levels.append(_halve(self.levels[-1]))

    def __call__(self, places: np.ndarray, footprints: np.ndarray) -> np.ndarray:
        """Means over the footprints of N pixels.

        Args:
            places: (N, 2) middles, column and row [texels]; texel k reaches from k to k + 1.
            footprints: (N, 2, 2), by how much column and row (axis 1) change from a pixel to the one beside
                it and to the one below (axis 2) [texels]. Those below one texel are interpolated.

        Returns:
            (N, C) float64.
        """
        narrow = np.linalg.svd(footprints, compute_uv=False)[:, 1:]
        sides = np.linalg.norm(footprints, axis=1)
        reads = np.ceil(sides / np.maximum(narrow / FINER, 1.0) - TOLERANCE)
        counts = np.clip(reads, 1, READS).astype(np.int64)
        level = np.log2(np.maximum((sides / counts).max(1), 1.0))
        parts = np.split(np.arange(len(places)), range(PIXELS, len(places), PIXELS))
        return np.concatenate([self._means(places[p], footprints[p], counts[p], level[p]) for p in parts])

    def _means(
        self, places: np.ndarray, footprints: np.ndarray, counts: np.ndarray, level: np.ndarray
    ) -> np.ndarray:
        """(N, C) means of `counts` (N, 2) reads of the levels around `level` (N,)."""
        reads = counts.prod(1)
        starts = np.cumsum(reads) - reads
        pixel = np.repeat(np.arange(len(places)), reads)
        index = np.arange(len(pixel)) - starts[pixel]
        across = counts[pixel, 1]
        offset = (np.column_stack([index // across, index % across]) + 0.5) / counts[pixel] - 0.5  # in pixels
        inner = places[pixel] + (footprints[pixel] @ offset[:, :, None])[..., 0]
        return np.add.reduceat(self._trilinear(inner, level[pixel]), starts) / reads[:, None]

    def _trilinear(self, places: np.ndarray, level: np.ndarray) -> np.ndarray:
        """(N, C) values at places (N, 2), interpolated within and between the levels around `level` (N,)."""
        level = np.clip(level, 0, len(self.levels) - 1)
        lower = np.minimum(level.astype(np.int64), max(len(self.levels) - 2, 0))
        upper = np.minimum(lower + 1, len(self.levels) - 1)
        share = (level - lower)[:, None]
        values = np.empty((2, len(places), self.levels[0].shape[2]))
        for row, index in zip(values, (lower, upper), strict=True):
            for k in np.unique(index):
                row[index == k] = self._bilinear(places[index == k], self.levels[k])
        return (1 - share) * values[0] + share * values[1]

    def _bilinear(self, places: np.ndarray, level: np.ndarray) -> np.ndarray:
        """(N, C) values of one level (h, w, C) at places (N, 2) [texels of the image]."""
        size = np.array(level.shape[1::-1])
        position = places * (size / self.levels[0].shape[1::-1]) - 0.5
        corner = np.floor(position).astype(np.int64)
        share = position - corner
        (left, top), (right, bottom) = ((corner + k).T % size[:, None] for k in (0, 1))
        across, down = share[:, :1], share[:, 1:]
        upper = (1 - across) * level[top, left] + across * level[top, right]
        lower = (1 - across) * level[bottom, left] + across * level[bottom, right]
        return (1 - down) * upper + down * lower


def _halve(image: np.ndarray) -> np.ndarray:
    """Half as many texels in each direction, at least one; means over their areas."""
    rows, columns = (_area_weights(size) for size in image.shape[:2])
    return np.einsum("rh,hwc,sw->rsc", rows, image, columns, optimize=True)


def _area_weights(size: int) -> np.ndarray:
    """(size / 2, size) shares of texels in texels twice as long, or a bit longer if the size is odd."""
    ends = np.linspace(0, size, max(size // 2, 1) + 1)[:, None]
    texel = np.arange(size)
    overlap = np.minimum(ends[1:], texel + 1) - np.maximum(ends[:-1], texel)
    return overlap.clip(0) / np.diff(ends, axis=0)
