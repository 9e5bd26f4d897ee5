"""A mesh as decoders read it: states, positions and edge lengths at any of its points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from mitex.mesh import Mesh, Similarity
from mitex.mesh.gradients import values_and_gradients
from mitex.plugins import init
from mitex.sparse import LinearMap, Weights
from mitex.textures.interpolation import Kind, SurfaceLookup

# Mean length of the edges in decoder units: that of the sphere that the default preset trains on. So even
# meshes of any size mix waves in the shares that the training saw.
EDGE = 0.03775


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
        mesh: the mesh; texture depends neither on its place nor on its size.
        interpolation: of the states, "smooth" or "linear".
        device: of the states; points are on the CPU.
    """

    def __init__(
        self, mesh: Mesh, interpolation: Kind = "smooth", device: torch.device | str = "cpu"
    ) -> None:
        init(needs="ad")
        mesh = mesh.with_vertices(decoder_units(mesh).apply(mesh.vertices))
        self.mesh, self.device = mesh, device
        self._lookup = SurfaceLookup(mesh, interpolation)
        self._table = LinearMap(values_and_gradients(mesh), device) if interpolation == "smooth" else None
        corners = np.column_stack([mesh.vertices, mesh.edge_lengths]).astype(np.float32)
        self._corners = torch.from_numpy(corners)
        self._faces = torch.from_numpy(mesh.faces.astype(np.int64))

    def table(self, state: torch.Tensor) -> torch.Tensor:
        """What `read` reads, of a state (V, C)."""
        return state if self._table is None else self._table(state)

    def read(self, table: torch.Tensor, points: Points) -> torch.Tensor:
        """The interpolated state at the points: (P, C)."""
        return self.weights(points)(table)

    def weights(self, points: Points) -> Weights:
        """What `read` does at points, for points that are read more than once."""
        return self._lookup.weights(points.face, points.barycentric).to(self.device)

    def place(self, points: Points) -> tuple[torch.Tensor, torch.Tensor]:
        """Positions (P, 3) and lengths of the edges around (P,) of the points [decoder units]."""
        corners = self._corners[self._faces[points.face.long()]]
        values = (points.barycentric[:, :, None] * corners).sum(1)
        values = values.to(self.device)
        return values[:, :3], values[:, 3]


def vertex_points(mesh: Mesh) -> Points:
    """The vertices as points of the mesh, each at the corner of one of its faces."""
    face, corner = np.zeros(len(mesh.vertices), np.int32), np.zeros(len(mesh.vertices), np.int64)
    for k in range(3):
        face[mesh.faces[:, k]], corner[mesh.faces[:, k]] = np.arange(len(mesh.faces)), k
    return Points(torch.from_numpy(face), torch.from_numpy(np.eye(3, dtype=np.float32)[corner]))


def decoder_units(mesh: Mesh) -> Similarity:
    """From a mesh's units to decoder units: the vertices' mean is the origin, the edges' mean is `EDGE`."""
    graph, points = mesh.edges, mesh.vertices.astype(np.float64)
    lengths = np.linalg.norm(points[graph.indices] - points[graph.rows], axis=1)
    mean = float(lengths.mean()) if len(lengths) else 0.0
    return Similarity(points.mean(axis=0), mean / EDGE if mean > 0 else 1.0)
