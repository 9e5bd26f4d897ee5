"""A surface whose vertices move smoothly."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse
import torch

from mitex.mesh import Mesh
from mitex.mesh.connection import solver


class Shape:
    """Vertices that move together with those around (Nicolet et al. 2021, "Large steps", equation 9).

    What is optimized are not the offsets x but u = (I + lambda L) x with the Laplacian L of the edges: a step
    in u moves a vertex and, the less the further away, its neighbours.

    Args:
        mesh: V vertices, whose normals the offsets follow.
        smoothing: lambda.
        sideways: factor of the offsets along the surface; with 0 vertices move along their normals only.
    """

    def __init__(self, mesh: Mesh, smoothing: float, sideways: float) -> None:
        self.mesh, self.sideways = mesh, sideways
        self._plain, self.normals = torch.tensor(mesh.vertices), torch.tensor(mesh.normals)
        graph, count = mesh.edges, len(mesh.vertices)
        neighbours = scipy.sparse.csr_array(
            (np.ones(len(graph.indices)), graph.indices, graph.indptr), shape=(count, count)
        )
        laplacian = scipy.sparse.diags_array(graph.valence.astype(float)) - neighbours
        self._matrix = (scipy.sparse.eye_array(count) + smoothing * laplacian).tocsc()
        self._solve = solver(self._matrix)

    def coordinates(self, heights: np.ndarray) -> torch.Tensor:
        """The u (V, 3) float32 of vertices that are raised by heights (V,) along their normals."""
        raised = heights[:, None] * self.mesh.normals.astype(np.float64)
        return torch.from_numpy((self._matrix @ raised).astype(np.float32))

    def offsets(self, coordinates: torch.Tensor) -> torch.Tensor:
        """The x (V, 3) of u (V, 3); differentiable."""
        smooth = _Solution.apply(coordinates, self._solve)
        if self.sideways == 1:
            return smooth
        upward = (smooth * self.normals).sum(1, keepdim=True) * self.normals
        return upward + self.sideways * (smooth - upward)

    def heights(self, offsets: torch.Tensor) -> torch.Tensor:
        """(V, 1): how far offsets (V, 3) raise the vertices along their normals."""
        return (offsets * self.normals).sum(1, keepdim=True)

    def moved(self, offsets: torch.Tensor) -> torch.Tensor:
        """The vertices (V, 3) in their new places."""
        return self._plain + offsets


class _Solution(torch.autograd.Function):
    """The solution of a symmetric system, column by column: its derivative solves the same system."""

    @staticmethod
    def forward(ctx: Any, right: torch.Tensor, solve: Any) -> torch.Tensor:
        ctx.solve = solve
        return _solved(solve, right)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor):
        return _solved(ctx.solve, gradients[0]), None


def _solved(solve: Any, right: torch.Tensor) -> torch.Tensor:
    return torch.from_numpy(solve(right.detach().numpy().astype(np.float64)).astype(np.float32))
