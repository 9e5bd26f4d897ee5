"""The coarse part of a relief: measured on a training mesh, and drawn at random for any other mesh.

Coarse levels cannot show features that are narrower than about four of their edges, and what they pass on
instead is arbitrary. So generators may begin on the first level that resolves the features (`first_level`).
Something else has to say then where each of them goes: the coarse part of the relief, which lies between two
low-pass filters. The first generator learns to complete that of the reference. For other meshes it is drawn
alike: evenly placed bumps or dents where the reference has such, else noise with the same spectrum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.mesh.low_pass import blurred, low_pass
from mitex.methods.geometric.placement import even_places, separate_tops

# Widths of filters, half an octave apart [mean edges]: the last leaves the shape without its relief, and the
# difference of two successive ones is a band.
WIDTHS = (1.0, 2.0**0.5, 2.0, 8.0**0.5, 4.0)
SKEWED = 0.5  # skewness of heights from which on they are bumps, or dents, on a ground


@dataclass(frozen=True)
class CoarseRelief:
    """How the coarse part of a relief is distributed.

    Attributes:
        spread: standard deviation of its heights [mean edges].
        bands: that of each of its bands [mean edges].
        faces: for each bump or dent, on average; 0 where there are no separate ones.
        side: 1 for bumps, -1 for dents.
    """

    spread: float
    bands: Sequence[float]
    faces: float = 0.0
    side: float = 1.0

    def on(self, mesh: Mesh) -> Callable[[int], np.ndarray]:
        """What draws it for a mesh: from a seed to vertices (V, 3) float64, moved along the normals."""
        edge, bands = _mean_edge(mesh), _bands(mesh)
        smooth = low_pass(mesh, WIDTHS[0] * edge)  # single impulses have more below the finest band

        def drawn(seed: int) -> np.ndarray:
            if self.faces:
                impulses = np.zeros(len(mesh.vertices))
                impulses[even_places(mesh, self.faces, seed)] = self.side
            else:
                impulses = np.random.default_rng(seed).normal(size=len(mesh.vertices))
            parts = bands(smooth(impulses))
            heights = np.array(self.bands) @ (parts / np.maximum(parts.std(1, keepdims=True), 1e-12))
            heights *= self.spread * edge / max(float(heights.std()), 1e-12)
            return mesh.vertices + heights[:, None] * mesh.normals

        return drawn


class Start(NamedTuple):
    """What a training begins with on its first level, on the mesh without relief.

    Attributes:
        own: (V, 3) displacements, the coarse part of the reference's relief.
        drawn: (V, 3) vertices each, with others like it.
    """

    own: np.ndarray
    drawn: Sequence[np.ndarray]


def split(mesh: Mesh) -> tuple[Mesh, np.ndarray, CoarseRelief]:
    """A training mesh without its relief, and the coarse part of that.

    Returns:
        The mesh without relief, the displacements (V, 3) of the coarse part, and its distribution.
    """
    edge = _mean_edge(mesh)
    base = blurred(mesh, WIDTHS[-1] * edge)
    offsets = dot(mesh.vertices - base.vertices.astype(np.float64), base.normals)
    parts = _bands(base)(offsets)
    heights = parts.sum(0)
    spread = float(heights.std())
    skewness = float(np.mean(heights**3)) / max(spread, 1e-12) ** 3
    side = 1.0 if skewness > 0 else -1.0
    tops = separate_tops(base, side * heights) if abs(skewness) > SKEWED else None
    faces = 0.0 if tops is None else len(mesh.faces) / len(tops)
    bands = [float(part.std()) / edge for part in parts]
    return base, heights[:, None] * base.normals, CoarseRelief(spread / edge, bands, faces, side)


def _bands(mesh: Mesh) -> Callable[[np.ndarray], np.ndarray]:
    """What splits heights (V,) into bands (N, V), the finest first, each with a mean of 0."""
    edge = _mean_edge(mesh)
    filters = [low_pass(mesh, width * edge) for width in WIDTHS]

    def bands(heights: np.ndarray) -> np.ndarray:
        parts = np.array([fine - wide for fine, wide in pairwise(f(heights) for f in filters)])
        return parts - parts.mean(1, keepdims=True)

    return bands


def _mean_edge(mesh: Mesh) -> float:
    return float(mesh.edge_lengths.mean())
