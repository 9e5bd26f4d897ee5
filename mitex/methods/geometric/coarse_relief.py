"""The coarse part of a relief: measured on a training mesh, and drawn at random for any other mesh.

Coarse levels cannot show features that are narrower than about four of their edges, and what they pass on
instead is arbitrary. So generators may begin on the first level that resolves the features (`first_level`).
Something else has to say then where each of them goes: the part of the relief whose lengths lie between `FINE`
and `WIDE`. The first generator learns to complete that of the reference. For other meshes it is drawn with the
same spread: evenly placed bumps or dents where the reference has such, noise where heights go up as often as
down.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.methods.geometric.low_pass import blurred, low_pass
from mitex.methods.geometric.placement import even_places, separate_tops

FINE, WIDE = 1.0, 4.0  # widths of the filters between which the coarse part lies [mean edges]
SKEWED = 0.5  # skewness of heights from which on they are bumps, or dents, on a ground


@dataclass(frozen=True)
class CoarseRelief:
    """How the coarse part of a relief is distributed.

    Attributes:
        spread: standard deviation of its heights [mean edges].
        faces: for each bump or dent, on average; 0 where there are no separate ones.
        side: 1 for bumps, -1 for dents.
    """

    spread: float
    faces: float = 0.0
    side: float = 1.0

    def on(self, mesh: Mesh) -> Callable[[int], np.ndarray]:
        """What draws it for a mesh: from a seed to vertices (V, 3) float64, moved along the normals."""
        edge, band = _mean_edge(mesh), _band(mesh)

        def drawn(seed: int) -> np.ndarray:
            if self.faces:
                impulses = np.zeros(len(mesh.vertices))
                impulses[even_places(mesh, self.faces, seed)] = self.side
            else:
                impulses = np.random.default_rng(seed).normal(size=len(mesh.vertices))
            heights = band(impulses)
            heights *= self.spread * edge / max(float(heights.std()), 1e-12)
            return mesh.vertices + heights[:, None] * mesh.normals

        return drawn


def split(mesh: Mesh) -> tuple[Mesh, np.ndarray, CoarseRelief]:
    """A training mesh without its relief, and the coarse part of that.

    Returns:
        The mesh without relief, the displacements (V, 3) of the coarse part, and its distribution.
    """
    edge = _mean_edge(mesh)
    base = blurred(mesh, WIDE * edge)
    heights = dot(low_pass(mesh, FINE * edge)(mesh.vertices.astype(np.float64)) - base.vertices, base.normals)
    heights -= heights.mean()
    spread = float(heights.std())
    skewness = float(np.mean(heights**3)) / max(spread, 1e-12) ** 3
    side = 1.0 if skewness > 0 else -1.0
    tops = separate_tops(base, side * heights) if abs(skewness) > SKEWED else None
    faces = 0.0 if tops is None else len(mesh.faces) / len(tops)
    return base, heights[:, None] * base.normals, CoarseRelief(spread / edge, faces, side)


def _band(mesh: Mesh) -> Callable[[np.ndarray], np.ndarray]:
    """The part of heights (V,) that lies between the two filters, with a mean of 0."""
    edge = _mean_edge(mesh)
    fine, wide = (low_pass(mesh, width * edge) for width in (FINE, WIDE))

    def band(heights: np.ndarray) -> np.ndarray:
        part = fine(heights) - wide(heights)
        return part - part.mean()

    return band


def _mean_edge(mesh: Mesh) -> float:
    return float(mesh.edge_lengths.mean())
