"""Scales of one mesh: every level has four times the faces of the one before, and edges as long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch

from mitex.mesh import Mesh, subdivide_midpoint
from mitex.mesh.topology import face_edges
from mitex.methods.geometric.connectivity import FaceGraph, check_corners
from mitex.methods.geometric.directions import face_directions


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """The connectivity of a mesh subdivided 0, 1, 2, ... times.

    Attributes:
        meshes: the mesh on each level; splitting it moves nothing.
        graphs: of each level.
        pairs: for each level but the last, (E, 2) int64, the ends of the edges that are split next.
    """

    meshes: tuple[Mesh, ...]
    graphs: tuple[FaceGraph, ...]
    pairs: tuple[torch.Tensor, ...]

    @staticmethod
    def of(mesh: Mesh, levels: int) -> Hierarchy:
        """The hierarchy of a mesh.

        Args:
            mesh: its first level.
            levels: how many there are in all, at least 1.

        Raises:
            MeshError: a face names a vertex twice.
        """
        check_corners(mesh)
        meshes = [mesh]
        for _ in range(levels - 1):
            meshes.append(subdivide_midpoint(meshes[-1]))
        graphs = tuple(FaceGraph.of(m.faces, len(m.vertices)) for m in meshes)
        pairs = tuple(torch.from_numpy(face_edges(m.faces, len(m.vertices))[0]) for m in meshes[:-1])
        return Hierarchy(tuple(meshes), graphs, pairs)

    def directed(self, fields: Sequence[torch.Tensor], symmetric: bool) -> Hierarchy:
        """The same with directions on all faces.

        Args:
            fields: (V, 3) of each level, unit vectors or zero.
            symmetric: whether a direction and its opposite are the same.
        """
        graphs = tuple(
            replace(graph, directions=face_directions(field, graph.faces, symmetric), symmetric=symmetric)
            for graph, field in zip(self.graphs, fields, strict=True)
        )
        return replace(self, graphs=graphs)

    def to(self, device: torch.device | str) -> Hierarchy:
        """The same with graphs and pairs on another device."""
        graphs = tuple(graph.to(device) for graph in self.graphs)
        return replace(self, graphs=graphs, pairs=tuple(pairs.to(device) for pairs in self.pairs))

    def finer(self, vertices: torch.Tensor, level: int) -> torch.Tensor:
        """Vertices (..., V, 3) of a level, split and scaled by 2 for the next: edges keep their length."""
        ends = vertices[..., self.pairs[level], :]
        return torch.cat([2 * vertices, ends.sum(-2)], -2)


def mean_edge(vertices: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
    """Mean length of the sides of all faces (F, 3) of vertices (V, 3); an inner edge counts twice."""
    corners = vertices[graph.faces]
    return (corners.roll(-1, 1) - corners).norm(dim=-1).mean()
