"""The colours of an exemplar, and which colours on a mesh are none of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.cluster.vq import kmeans2
from scipy.spatial import KDTree

COLOURS = 64
PIXELS = 16_384  # that the colours are taken from
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
