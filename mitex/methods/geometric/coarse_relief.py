"""The coarse part of a relief: measured on a training mesh, and drawn at random for any other mesh.

Coarse levels cannot show features that are narrower than about four of their edges, and what they pass on
instead is arbitrary. So generators may begin on the first level that resolves the features (`first_level`).
Something else has to say then where each of them goes: the coarse part of the relief, which lies between two
low-pass filters. The first generator learns to complete that of the reference. For other meshes it is drawn
with the same spread: evenly placed bumps or dents where the reference has such, else noise. Noise has not the
form of ridges, so that less of these is given, and more is left to the generator.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.methods.geometric.low_pass import blurred, low_pass
from mitex.methods.geometric.placement import even_places, separate_tops

WIDE = 4.0  # width of the filter that leaves the shape without its relief [mean edges]
OF_BUMPS, OF_NOISE = 1.0, 2.0  # of that which leaves the coarse part as well, if it is drawn as these
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
        edge = _mean_edge(mesh)
        width = OF_BUMPS if self.faces else OF_NOISE
        fine, wide = (low_pass(mesh, value * edge) for value in (width, WIDE))

        def drawn(seed: int) -> np.ndarray:
            if self.faces:
                impulses = np.zeros(len(mesh.vertices))
                impulses[even_places(mesh, self.faces, seed)] = self.side
            else:
                impulses = np.random.default_rng(seed).normal(size=len(mesh.vertices))
            heights = fine(impulses) - wide(impulses)
            heights -= heights.mean()
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
    heights = _heights(mesh, base, OF_BUMPS * edge)
    skewness = float(np.mean(heights**3)) / max(float(heights.std()), 1e-12) ** 3
    side = 1.0 if skewness > 0 else -1.0
    tops = separate_tops(base, side * heights) if abs(skewness) > SKEWED else None
    if tops is None:
        heights = _heights(mesh, base, OF_NOISE * edge)
        coarse = CoarseRelief(float(heights.std()) / edge)
    else:
        coarse = CoarseRelief(float(heights.std()) / edge, len(mesh.faces) / len(tops), side)
    return base, heights[:, None] * base.normals, coarse


def _heights(mesh: Mesh, base: Mesh, width: float) -> np.ndarray:
    """(V,) of a mesh after a low-pass filter, above its base and along the normals of that; the mean is 0."""
    filtered = low_pass(mesh, width)(mesh.vertices.astype(np.float64))
    heights = dot(filtered - base.vertices, base.normals)
    return heights - heights.mean()


def _mean_edge(mesh: Mesh) -> float:
    return float(mesh.edge_lengths.mean())
