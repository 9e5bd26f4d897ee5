"""The colours of an exemplar, and which colours on a mesh are none of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.cluster.vq import kmeans2
from scipy.spatial import KDTree

COLOURS = 64
PIXELS = 16_384  # that the colours are taken from
NEARLY = np.float32(0.999)  # of a distance that rounding shall not exceed
TOLERANCE = 0.08  # [sRGB], beyond the exemplar's own spread around the colours


@dataclass(frozen=True, eq=False)
class Palette:
    """Typical colours.

    Attributes:
        colours: (N, 3) sRGB.
        radius: distance within which nearly all pixels have one of them.
    """

    colours: np.ndarray
    radius: float

    @staticmethod
    def of(albedo: np.ndarray) -> Palette:
        """Of an exemplar's albedo (H, W, 3), sRGB in [0, 1]."""
        rng = np.random.default_rng(0)
        pixels = rng.permutation(albedo.reshape(-1, 3))[:PIXELS].astype(np.float64)
        count = min(COLOURS, len(np.unique(pixels, axis=0)))
        colours, _ = kmeans2(pixels, count, minit="++", rng=rng)
        return Palette(colours, float(np.quantile(KDTree(colours).query(pixels)[0], 0.999)))

    def unlike(self, colours: np.ndarray) -> np.ndarray:
        """Which of the colours (P, 3) are none of these: (P,) bool."""
        return KDTree(self.colours).query(colours)[0] > self.radius + TOLERANCE

    def project(self, colours: np.ndarray) -> np.ndarray:
        """Colours (P, 3) float32, of which those that are none of these are moved to the nearest one, as far
        as it takes.
        """
        palette, limit = self.colours.astype(np.float32), np.float32(self.radius + TOLERANCE) * NEARLY
        squared = (palette**2).sum(axis=1) - 2 * colours @ palette.T  # and a term that all have in common
        nearest = palette[squared.argmin(axis=1)]
        offsets = colours - nearest
        distance = np.linalg.norm(offsets, axis=1, keepdims=True)
        return nearest + offsets * np.minimum(limit / np.maximum(distance, limit), 1)

    def record(self) -> dict[str, object]:
        """As JSON values."""
        return {"colours": self.colours.round(3).tolist(), "radius": round(self.radius, 4)}

    @staticmethod
    def from_record(record: dict) -> Palette:
        """From what `record` returned.

        Raises:
            ValueError: it is not that; a KeyError or a TypeError may come too.
        """
        colours, radius = np.asarray(record["colours"], np.float64).reshape(-1, 3), float(record["radius"])
        if not len(colours) or not np.isfinite([*colours.ravel(), radius]).all():
            raise ValueError("a palette without colours, or with some that are not finite")
        return Palette(colours, radius)
