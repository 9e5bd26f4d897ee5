"""Filtered lookup of images: a mip map (Williams 1983), read along the longer axis of a pixel's footprint.

A pixel that covers many texels shows their mean; one texel in its place is noise. Where a surface is seen
flat, footprints are long: several squares side by side cover them (Feline, McCormack et al. 1999).
"""

from __future__ import annotations

import numpy as np

PROBES = 64  # squares that a footprint is covered with, at most


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
        axes, lengths, _ = np.linalg.svd(footprints)
        long, short = lengths[:, 0], np.maximum(lengths[:, 1], 1.0)
        count = np.clip(np.ceil(long / short), 1, PROBES).astype(np.int64)
        level = np.log2(np.maximum(long / count, short))
        along = axes[:, :, 0] * long[:, None]
        total = np.zeros((len(places), self.levels[0].shape[2]))
        for k in range(count.max(initial=0)):
            part = np.flatnonzero(count > k)
            offset = ((k + 0.5) / count[part] - 0.5)[:, None] * along[part]
            total[part] += self._trilinear(places[part] + offset, level[part])
        return total / count[:, None]

    def _trilinear(self, places: np.ndarray, level: np.ndarray) -> np.ndarray:
        level = np.clip(level, 0, len(self.levels) - 1)
        lower = np.minimum(level.astype(np.int64), max(len(self.levels) - 2, 0))
        upper = np.minimum(lower + 1, len(self.levels) - 1)
        share = (level - lower)[:, None]
        values = np.empty((2, len(places), self.levels[0].shape[2]))
        for row, chosen in zip(values, (lower, upper), strict=True):
            for k in np.unique(chosen):
                row[chosen == k] = self._bilinear(places[chosen == k], self.levels[k])
        return (1 - share) * values[0] + share * values[1]

    def _bilinear(self, places: np.ndarray, level: np.ndarray) -> np.ndarray:
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
