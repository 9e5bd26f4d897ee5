"""What a state shows that its exemplar does not, and growing such places anew."""

from __future__ import annotations

import warnings

import numpy as np
import torch

from mitex.errors import TextureWarning
from mitex.mesh import Mesh
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.growth import Growth

ROUNDS, STEPS = 3, 60  # of growing anew, and the automaton's steps in each
RINGS = 3  # of neighbours that start anew too


@torch.no_grad()
def healed(growth: Growth, state: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """A state (V, C) in which places of foreign colours were set back to the seed and have grown again.

    A rule that was trained to grow from the seed and to keep its pattern repairs what is taken away. Where
    foreign colours stay after all rounds, a `TextureWarning` says how much of the mesh has them. Only regions
    count, see `inner`.
    """
    cells = growth.cells
    for _ in range(ROUNDS):
        places = growth.foreign(state)
        if not inner(cells.mesh, places).any():
            return state
        state = torch.where(torch.from_numpy(_around(cells, places))[:, None], 0.0, state)
        state = growth.evolve(state, STEPS, generator)
    places = growth.foreign(state)
    if inner(cells.mesh, places).any():
        warnings.warn(
            f"{places.mean():.1%} of '{cells.base.name}' has colours that the exemplar does not have; "
            "try another seed, or remesh it evenly",
            TextureWarning,
            stacklevel=5,
        )
    return state


def inner(mesh: Mesh, places: np.ndarray) -> np.ndarray:
    """Those of the vertices `places` (V,) bool all of whose neighbours are among them.

    Dots and thin lines have none: between two colours of an exemplar there are mixtures that it need not
    have.
    """
    graph = mesh.edges
    return places & (np.bincount(graph.rows, ~places[graph.indices], len(places)) == 0)


def _around(cells: Cells, places: np.ndarray) -> np.ndarray:
    """The vertices and their neighbours, `RINGS` times."""
    graph = cells.mesh.edges
    for _ in range(RINGS):
        places = places | (np.bincount(graph.rows, places[graph.indices], len(places)) > 0)
    return places
