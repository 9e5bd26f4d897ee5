"""A mesh as decoders read it: states, positions and edge lengths at any of its points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from mitex.mesh import Mesh
from mitex.mesh.gradients import values_and_gradients
from mitex.plugins import init
from mitex.sparse import LinearMap
from mitex.textures.interpolation import Kind, SurfaceLookup


@dataclass(frozen=True, eq=False)
class Points:
    """Points on a mesh.

    Attributes:
        face: (P,) int32.
        barycentric: (P, 3) float32.
    """

    face: torch.Tensor
    barycentric: torch.Tensor


class Surface:
    """The mesh that an automaton runs on.

    Args:
        mesh: the mesh; it is normalised.
        interpolation: of the states, "smooth" or "linear".
    """

    def __init__(self, mesh: Mesh, interpolation: Kind = "smooth") -> None:
        init()
        # Solid noise must depend neither on units nor on the place, and float32 needs small numbers.
        mesh = mesh.normalised()[0]
        self.mesh = mesh
        self._lookup = SurfaceLookup(mesh, interpolation)
        self._table = LinearMap(values_and_gradients(mesh)) if interpolation == "smooth" else None
        self._corners = torch.from_numpy(np.column_stack([mesh.vertices, _edges(mesh)]).astype(np.float32))
        self._faces = torch.from_numpy(mesh.faces.astype(np.int64))

    def table(self, state: torch.Tensor) -> torch.Tensor:
        """What `read` reads, of a state (V, C)."""
        return state if self._table is None else self._table(state)

    def read(self, table: torch.Tensor, points: Points) -> torch.Tensor:
        """The interpolated state at the points: (P, C)."""
        return self._lookup.weights(points.face, points.barycentric)(table)

    def place(self, points: Points) -> tuple[torch.Tensor, torch.Tensor]:
        """Positions (P, 3) and lengths of the edges around (P,) of the points [normalised mesh units]."""
        corners = self._corners[self._faces[points.face.long()]]
        values = (points.barycentric[:, :, None] * corners).sum(1)
        return values[:, :3], values[:, 3]


def _edges(mesh: Mesh) -> np.ndarray:
    """(V,) mean lengths of the edges at each vertex; of all edges where it has none."""
    graph = mesh.edges
    lengths = np.linalg.norm(mesh.vertices[graph.indices] - mesh.vertices[graph.rows], axis=1)
    total = np.bincount(graph.rows, lengths, len(mesh.vertices))
    mean = float(lengths.mean()) if len(lengths) else 1.0
    return np.where(total > 0, total / np.maximum(np.diff(graph.indptr), 1), mean)
