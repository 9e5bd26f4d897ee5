"""The trained generators of all levels, and how they displace a mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import torch

from mitex.methods.geometric.gan import generate
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.network import FaceNetwork

# Channels of the hidden layers by level; all further levels have those of the last.
WIDTHS = ((32, 32, 32, 32, 32), (64, 32, 32, 32, 32), (128, 64, 32, 32, 32))


def network(level: int, outputs: int, generator: torch.Generator, directed: bool = False) -> FaceNetwork:
    """A generator (3 outputs) or critic (1) of a level, with fresh weights; see `FaceNetwork`."""
    return FaceNetwork(WIDTHS[min(level, len(WIDTHS) - 1)], outputs, generator, directed)


def grow(
    generators: Sequence[FaceNetwork],
    hierarchy: Hierarchy,
    vertices: torch.Tensor,
    noises: Sequence[torch.Tensor | float],
    remeasure: bool = False,
) -> Iterator[torch.Tensor]:
    """The mesh after each of successive generators, split and scaled by 2 in between.

    Args:
        generators: one for each level of the hierarchy that is used.
        hierarchy: of the mesh; it starts with its own connectivity.
        vertices: (V, 3), in units of the mean edge length.
        noises: for each generator, (V, 3) of its level or one number.
        remeasure: as in `generate`.
    """
    for level, (generator, noise) in enumerate(zip(generators, noises, strict=True)):
        if level:
            vertices = hierarchy.finer(vertices, level - 1)
        vertices = generate(generator, vertices, hierarchy.graphs[level], noise, remeasure)
        yield vertices
