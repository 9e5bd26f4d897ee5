"""The coarse part of a relief: taken from a training mesh, and laid anew on any other mesh.

Coarse levels cannot show features that are narrower than about four of their edges, and what they pass on
instead is arbitrary. So generators may begin on the first level that resolves the features (`first_level`).
Something else has to say then where each of them goes, and which way it runs: the coarse part of the relief,
which lies between two low-pass filters. The first generator learns to complete that of the reference. For
other meshes it is quilted: patches of it, turned in many directions, or along a field, are joined where they
fit (Efros and Freeman 2001, on the surface).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.mesh.frames import vertex_directions
from mitex.mesh.low_pass import blurred, low_pass
from mitex.quilting.matching import ArraySource
from mitex.quilting.surface import quilt_on
from mitex.quilting.vertices import VertexTarget, vertex_patches

FINE, WIDE = 1.0, 4.0  # widths of the filters [mean edges]; behind the wide one there is no relief
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

    def on(self, mesh: Mesh, field: np.ndarray | None = None) -> Callable[[int], np.ndarray]:
        """What lays it on a mesh: from a seed to vertices (V', 3) float64, moved along the normals.

        Args:
            mesh: V' vertices.
            field: (V', 3) that it shall follow, if it follows one.
        """
        patches, edge = self.patches, _mean_edge(mesh)
        target = VertexTarget(mesh, int(patches.length), edge / RATE, _right(mesh, field))
        spread = float(self.heights.std()) / _mean_edge(self.base)

        def laid(seed: int) -> np.ndarray:
            quilt = quilt_on(patches, target, np.random.default_rng(seed))
            heights = quilt.features[:, 0].astype(np.float64)
            heights -= heights.mean()
            heights *= spread * edge / max(float(heights.std()), 1e-12)  # joints are somewhat lower
            return mesh.vertices + heights[:, None] * mesh.normals

        return laid


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
    edge = _mean_edge(mesh)
    base = blurred(mesh, WIDE * edge)
    offsets = dot(mesh.vertices - base.vertices.astype(np.float64), base.normals)
    fine, wide = (low_pass(base, width * _mean_edge(base))(offsets) for width in (FINE, WIDE))
    heights = fine - wide
    return CoarseRelief(base, heights - heights.mean())


def _right(mesh: Mesh, field: np.ndarray | None) -> np.ndarray | None:
    """(V, 3) across a field and the normals."""
    return None if field is None else vertex_directions(mesh, field=field)


def _mean_edge(mesh: Mesh) -> float:
    return float(mesh.edge_lengths.mean())
