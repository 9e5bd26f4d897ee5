"""The texels of a layout by the faces that they lie on, so that those of some faces are at hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.geometry.raster import rasterize
from mitex.geometry.triangles import interpolate


@dataclass(frozen=True, eq=False)
class FaceTexels:
    """N texels, in the order of their faces.

    Attributes:
        side: of the map [texels].
        index: (N,) int64, row * side + column. Row 0 is on top.
        face: (N,) int32, ascending.
        barycentric: (N, 3) float32. Texels whose centres lie outside of their chart, by a texel at most,
            continue its nearest face: weights may be negative.
        first: (F + 1,) int64, where the texels of each face begin.
    """

    side: int
    index: np.ndarray
    face: np.ndarray
    barycentric: np.ndarray
    first: np.ndarray

    @staticmethod
    def rasterize(uv: np.ndarray, side: int) -> FaceTexels:
        """Of a layout (F, 3, 2) in [0, 1] in which nothing overlaps."""
        face, barycentric, _ = rasterize(uv, side)
        used = np.flatnonzero(face.ravel() >= 0)
        owner = face.ravel()[used]
        order = np.argsort(owner, kind="stable")
        counts = np.bincount(owner, minlength=len(uv))
        return FaceTexels(
            side,
            used[order],
            owner[order],
            barycentric.reshape(-1, 3)[used[order]],
            np.concatenate([[0], np.cumsum(counts)]),
        )

    def of(self, faces: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which texels lie on K faces, (M,), on which of these, (M,), and what is given at their corners,
        (K, 3, C), there, (M, C)."""
        counts = self.first[faces + 1] - self.first[faces]
        row = np.repeat(np.arange(len(faces)), counts)
        texel = np.arange(len(row)) + np.repeat(self.first[faces] - (np.cumsum(counts) - counts), counts)
        return texel, row, interpolate(self.barycentric[texel], corners[row])
