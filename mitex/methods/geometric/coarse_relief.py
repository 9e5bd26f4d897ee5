"""The coarse part of a relief: taken from a training mesh, and laid anew on any other mesh.

Coarse levels cannot show features that are narrower than about four of their edges, and what they pass on
instead is arbitrary. So generators may begin on the first level that resolves the features (`first_level`).
Something else has to say then where each of them goes, and which way it runs: the coarse part of the relief,
which lies between two low-pass filters. The first generator learns to complete that of the reference. For
other meshes it is quilted: patches of it, turned in many directions, or along a field, are joined where they
fit (Efros and Freeman 2001, on the surface). Separate bumps or dents, which would run together there, are
spread evenly instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.mesh.frames import vertex_directions
from mitex.mesh.low_pass import blurred, low_pass
from mitex.methods.geometric.placement import even_places, separate_tops
from mitex.quilting.matching import ArraySource
from mitex.quilting.surface import quilt_on
from mitex.quilting.vertices import VertexTarget, vertex_patches

# Widths of filters, half an octave apart [mean edges]: the last leaves the shape without its relief, and the
# difference of two successive ones is a band.
WIDTHS = (1.0, 2.0**0.5, 2.0, 8.0**0.5, 4.0)
SKEWED = 0.5  # skewness of heights from which on they are bumps, or dents, on a ground
PATCH = 16  # side of a patch [mean edges]
SHARE = 0.34  # of the side of a square as large as the mesh, at most
RATE = 2  # texels of a patch on an edge
PLACES, TURNS = 250, 8  # that patches are taken at, and directions


@dataclass(frozen=True, eq=False)
class CoarseRelief:
    """The coarse part of a reference's relief.

    Attributes:
        base: V vertices, the reference without its relief.
        heights: (V,) of the coarse part above it [mesh units].
        field: (V, 3) the vectors that it follows; None for a relief without a direction.
        symmetric: whether a vector and its opposite are the same.
    """

    base: Mesh
    heights: np.ndarray
    field: np.ndarray | None = None
    symmetric: bool = False

    @property
    def displacements(self) -> np.ndarray:
        """(V, 3) from the base to the coarse part."""
        return self.heights[:, None] * self.base.normals

    @cached_property
    def patches(self) -> ArraySource:
        """Squares of the heights [mean edges].

        Raises:
            ConfigError: none fits on the base.
        """
        edge = _mean_edge(self.base)
        side = min(PATCH * edge, SHARE * float(self.base.face_areas.sum()) ** 0.5)
        size = 8 * max(round(side / edge * RATE / 8), 1)
        heights = (self.heights / edge)[:, None]
        rng = np.random.default_rng(0)
        turns = TURNS if self.field is None else 1 + self.symmetric
        right = _right(self.base, self.field)
        patches = vertex_patches(self.base, heights, size, edge / RATE, PLACES, turns, rng, right)
        if not len(patches.values):
            raise ConfigError(
                f"no square {size // RATE} edges wide lies flat on {self.base.name}",
                "begin on a higher level (`first_level`)",
            )
        return patches

    @cached_property
    def bumps(self) -> int:
        """How many separate ones there are; below 0, dents; 0 along a field, or for other forms."""
        skewness = float(np.mean(self.heights**3)) / max(float(self.heights.std()), 1e-12) ** 3
        if self.field is not None or abs(skewness) < SKEWED:
            return 0
        side = 1 if skewness > 0 else -1
        tops = separate_tops(self.base, side * self.heights)
        return 0 if tops is None else side * len(tops)

    def on(self, mesh: Mesh, field: np.ndarray | None = None) -> Callable[[int], np.ndarray]:
        """What lays it on a mesh: from a seed to vertices (V', 3) float64, moved along the normals.

        Args:
            mesh: V' vertices.
            field: (V', 3) that it shall follow, if it follows one.
        """
        edge = _mean_edge(mesh)
        spread = float(self.heights.std()) / _mean_edge(self.base)
        heights_of = self._spread(mesh) if self.bumps else self._quilted(mesh, field)

        def laid(seed: int) -> np.ndarray:
            heights = heights_of(seed)
            heights = heights - heights.mean()
            heights *= spread * edge / max(float(heights.std()), 1e-12)  # joints are somewhat lower
            return mesh.vertices + heights[:, None] * mesh.normals

        return laid

    def _quilted(self, mesh: Mesh, field: np.ndarray | None) -> Callable[[int], np.ndarray]:
        """From a seed to heights (V',): patches, joined."""
        target = VertexTarget(mesh, int(self.patches.length), _mean_edge(mesh) / RATE, _right(mesh, field))

        def heights(seed: int) -> np.ndarray:
            quilt = quilt_on(self.patches, target, np.random.default_rng(seed))
            return quilt.features[:, 0].astype(np.float64)

        return heights

    def _spread(self, mesh: Mesh) -> Callable[[int], np.ndarray]:
        """From a seed to heights (V',): bumps or dents, as many on an area, each with the bands of all."""
        faces, side = len(self.base.faces) / abs(self.bumps), np.sign(self.bumps)
        own, bands = _bands(self.base), _bands(mesh)
        once = own(self.heights)
        # What was left of each band by the filters, they leave of it again.
        strengths = once.std(1) ** 2 / np.maximum(own(once.sum(0)).std(1), 1e-12)
        smooth = low_pass(mesh, WIDTHS[0] * _mean_edge(mesh))  # impulses have more below the finest band

        def heights(seed: int) -> np.ndarray:
            impulses = np.zeros(len(mesh.vertices))
            impulses[even_places(mesh, faces, seed)] = side
            parts = bands(smooth(impulses))
            return strengths @ (parts / np.maximum(parts.std(1, keepdims=True), 1e-12))

        return heights


class Start(NamedTuple):
    """What a training begins with on its first level, on the mesh without relief.

    Attributes:
        own: (V, 3) displacements, the coarse part of the reference's relief.
        laid: (V, 3) vertices each, with others like it.
    """

    own: np.ndarray
    laid: Sequence[np.ndarray]


def split(mesh: Mesh) -> CoarseRelief:
    """The coarse part of the relief of a training mesh, on the mesh without relief; its mean is 0."""
    base = blurred(mesh, WIDTHS[-1] * _mean_edge(mesh))
    heights = _bands(base)(dot(mesh.vertices - base.vertices.astype(np.float64), base.normals)).sum(0)
    return CoarseRelief(base, heights)


def _bands(mesh: Mesh) -> Callable[[np.ndarray], np.ndarray]:
    """What splits heights (V,) into bands (N, V), the finest first, each with a mean of 0."""
    edge = _mean_edge(mesh)
    filters = [low_pass(mesh, width * edge) for width in WIDTHS]

    def bands(heights: np.ndarray) -> np.ndarray:
        parts = np.array([fine - wide for fine, wide in pairwise(f(heights) for f in filters)])
        return parts - parts.mean(1, keepdims=True)

    return bands


def _right(mesh: Mesh, field: np.ndarray | None) -> np.ndarray | None:
    """(V, 3) across a field and the normals."""
    return None if field is None else vertex_directions(mesh, field=field)


def _mean_edge(mesh: Mesh) -> float:
    return float(mesh.edge_lengths.mean())
