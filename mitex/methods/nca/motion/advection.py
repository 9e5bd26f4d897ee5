"""States that are carried along a vector field: semi-Lagrangian advection (Stam 1999, "Stable Fluids").

A cell takes over what is upstream of it. Since a rule heals what it is not used to, its pattern goes along
with the states, and looks as it does when nothing moves; no rule has to learn it.
"""

from __future__ import annotations

import numpy as np
import torch

from mitex.mesh import Lattice, Mesh
from mitex.mesh.nearest import surface_points
from mitex.methods.nca.decoder.surface import Points, Surface


class Advection:
    """One step of it on a fixed surface; linear, and stable whatever the displacement.

    Args:
        surface: between whose vertices states are interpolated.
        upstream: of each cell, where it takes its state from.
        source: (V,) of which cell each vertex of the surface is a copy; None if there are no copies.
    """

    def __init__(self, surface: Surface, upstream: Points, source: np.ndarray | None = None) -> None:
        self.upstream, self._surface = upstream, surface
        self._weights = surface.weights(upstream)
        self._source = None if source is None else torch.from_numpy(source)

    def __call__(self, state: torch.Tensor) -> torch.Tensor:
        """States (B, V, C) or (V, C) one step later; differentiable in them."""
        if state.ndim == 3:
            return torch.stack([self(one) for one in state])
        spread = state if self._source is None else state[self._source]
        return self._weights(self._surface.table(spread))


def advection(mesh: Mesh, displacement: np.ndarray) -> Advection:
    """Of the vertices of a mesh, each by a tangent vector (V, 3) in its units."""
    where = surface_points(mesh, mesh.vertices.astype(np.float64) - displacement)
    return Advection(Surface(mesh), as_points(*where))


def flat_advection(lattice: Lattice, displacement: np.ndarray) -> Advection:
    """Of the cells in a lattice's square, each by a vector (V, 2) [edges along the rows]."""
    places = lattice.mesh.vertices[: lattice.count, :2].astype(np.float64)
    where = lattice.locate((places - displacement) / lattice.columns)
    return Advection(Surface(lattice.mesh), as_points(*where), lattice.source)


def as_points(face: np.ndarray, barycentric: np.ndarray) -> Points:
    """Points, as searches give them: faces (P,) and barycentrics (P, 3)."""
    return Points(torch.from_numpy(face.astype(np.int32)), torch.from_numpy(barycentric.astype(np.float32)))
