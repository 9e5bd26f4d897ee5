"""The coarse part of a relief: taken from a training mesh, and laid anew on any other mesh.

Coarse levels cannot show features that are narrower than about four of their edges, and what they pass on
instead is arbitrary. So generators may begin on the first level that resolves the features (`first_level`).
Something else has to say then where each of them goes, and which way it runs: the coarse part of the relief,
which lies between two low-pass filters. The first generator learns to complete that of the reference. For
other meshes it is quilted: patches of it, turned in many directions, or along a field, are joined where they
fit (Efros and Freeman 2001, on the surface). Separate bumps or dents, which would run together there, are
spread evenly instead, each with the mean profile of all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.mesh.frames import vertex_directions
from mitex.mesh.low_pass import blurred, low_pass
from mitex.mesh.nearest import distances
from mitex.methods.geometric.coarse_patches import RATE, cached_patches, height_patches
from mitex.methods.geometric.placement import even_places, separate_tops
from mitex.quilting.matching import ArraySource
from mitex.quilting.surface import quilt_on
from mitex.quilting.vertices import VertexTarget

FINE, WIDE = 1.0, 4.0  # widths of filters [mean edges]: what is wider than the second is shape
SKEWED = 0.5  # skewness of heights from which on they are bumps, or dents, on a ground
TURNS = 8  # directions of patches without a field
RING = 0.5  # width of a ring around a bump in which heights are averaged [mean edges]


@dataclass(frozen=True, eq=False)
class CoarseRelief:
    """The coarse part of a reference's relief.

    Attributes:
        base: V vertices, the reference without its relief.
        heights: (V,) of the coarse part above it [mesh units].
        field: (V, 3) the vectors that it follows; None for a relief without a direction.
        symmetric: whether a vector and its opposite are the same.
        kept: whether its patches are kept in the cache.
    """

    base: Mesh
    heights: np.ndarray
    field: np.ndarray | None = None
    symmetric: bool = False
    kept: bool = False

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
        turns = TURNS if self.field is None else 1 + self.symmetric
        patches = cached_patches if self.kept else height_patches
        return patches(self.base, self.heights, _right(self.base, self.field), turns)

    @cached_property
    def bumps(self) -> np.ndarray:
        """The vertices (N,) amid separate bumps or dents; none along a field, or for other forms."""
        skewness = float(np.mean(self.heights**3)) / max(float(self.heights.std()), 1e-12) ** 3
        if self.field is not None or abs(skewness) < SKEWED:
            return np.zeros(0, np.int64)
        tops = separate_tops(self.base, np.sign(skewness) * self.heights) or []
        points = self.base.vertices
        away = (np.linalg.norm(points[top] - points[top].mean(0), axis=1) for top in tops)
        return np.array([top[a.argmin()] for top, a in zip(tops, away, strict=True)], np.int64)

    def on(self, mesh: Mesh, field: np.ndarray | None = None) -> Callable[[int], np.ndarray]:
        """What lays it on a mesh: from a seed to vertices (V', 3) float64, moved along the normals.

        Args:
            mesh: V' vertices.
            field: (V', 3) that it shall follow, if it follows one.
        """
        edge = _mean_edge(mesh)
        spread = float(self.heights.std()) / _mean_edge(self.base)
        heights_of = self._spread(mesh) if len(self.bumps) else self._quilted(mesh, field)

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
        """From a seed to heights (V',): bumps or dents, as many on an area, each with the mean profile."""
        faces = len(self.base.faces) / len(self.bumps)
        away = distances(self.base, self.bumps) / _mean_edge(self.base)
        near = np.isfinite(away)
        ring = np.round(away[near] / RING).astype(np.int64)
        count = np.bincount(ring)
        radii = RING * np.flatnonzero(count)
        profile = np.bincount(ring, self.heights[near])[count > 0] / count[count > 0]

        def heights(seed: int) -> np.ndarray:
            away = distances(mesh, even_places(mesh, faces, seed)) / _mean_edge(mesh)
            return np.interp(away, radii, profile)

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
    """The coarse part of the relief of a training mesh, on the mesh without relief; its mean is 0.

    What is wider than `WIDE` is shape, unless separate bumps lie farther apart.
    """
    relief = _between(mesh, FINE, WIDE)
    if len(relief.bumps):
        apart = (float(mesh.face_areas.sum()) / len(relief.bumps)) ** 0.5
        relief = _between(mesh, FINE, max(WIDE, apart / _mean_edge(mesh)))
    return relief


def _between(mesh: Mesh, fine: float, wide: float) -> CoarseRelief:
    """What lies between two low-pass filters [mean edges]."""
    edge = _mean_edge(mesh)
    base = blurred(mesh, wide * edge)
    heights = dot(mesh.vertices - base.vertices.astype(np.float64), base.normals)
    passed = [low_pass(base, width * _mean_edge(base))(heights) for width in (fine, wide)]
    heights = passed[0] - passed[1]
    return CoarseRelief(base, heights - heights.mean())


def _right(mesh: Mesh, field: np.ndarray | None) -> np.ndarray | None:
    """(V, 3) across a field and the normals."""
    return None if field is None else vertex_directions(mesh, field=field)


def _mean_edge(mesh: Mesh) -> float:
    return float(mesh.edge_lengths.mean())
