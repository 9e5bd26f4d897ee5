"""Density and colours by a hash grid of features and two small networks (Mueller et al. 2022)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import torch

from mitex.methods.nerf.field.decoder import HIGHEST, sigmoid
from mitex.methods.nerf.field.hash_grid import CHANNELS, HashGrid
from mitex.methods.nerf.field.mlp import network_rows, packed_networks, weight_bound
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

WIDTH = 64  # channels of the hidden layers
CODE = 15  # channels that the density network hands to that of the colour
DIRECTION = 16  # spherical harmonics of a direction, up to degree 3
SMALL = 1e-4  # largest of the initial features


@dataclass(frozen=True, eq=False)
class GridLayout:
    """What a grid and its networks are made of.

    Attributes:
        grid: of features.
        directions: number of unit directions that colours depend on.
    """

    grid: HashGrid
    directions: int = 1

    @property
    def widths(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Of the layers of the density network and of that of the colour."""
        features = CHANNELS * len(self.grid.cells)
        return (features, WIDTH, CODE + 1), (CODE + DIRECTION * self.directions, WIDTH, WIDTH, 3)

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Of what is learned, by name: the grid's table, and the matrices (out, in) of both networks."""
        layers = [(o, i) for widths in self.widths for i, o in pairwise(widths)]
        return {"table": (self.grid.size,)} | {f"weights/{k}": shape for k, shape in enumerate(layers)}


class GridNetworks:
    """A grid and its networks with what they have learned.

    Args:
        layout: what they are made of.
        table: values of the grid, flat.
        matrices: of both networks, in the order of `GridLayout.shapes`.
        packed: evaluate as cooperative vectors, which is faster but has no derivatives.
    """

    def __init__(
        self, layout: GridLayout, table: mi.Float, matrices: Sequence[mi.TensorXf], packed: bool = False
    ) -> None:
        self.grid, self.table = layout.grid, table
        count = len(layout.widths[0]) - 1
        networks = list(matrices[:count]), list(matrices[count:])
        self._density, self._colour = packed_networks(*networks) if packed else networks

    @staticmethod
    def packed(layout: GridLayout, parameters: Mapping[str, torch.Tensor]) -> GridNetworks:
        """Of parameters in the order of `GridLayout.shapes`, without derivatives."""
        table, *matrices = (upload(mi.TensorXf, value.detach().numpy()) for value in parameters.values())
        return GridNetworks(layout, table.array, matrices, packed=True)

    def density(self, points: mi.Point3f) -> tuple[mi.Float, list[mi.Float]]:
        """Density of points in [-1, 1]^3 [1 / their units], and a code for the colour (15 arrays)."""
        exponent, *code = network_rows(self._density, self.grid(points, self.table))
        return dr.exp(dr.minimum(exponent, HIGHEST)), code

    def colour(self, code: Sequence[mi.Float], *directions: mi.Vector3f) -> mi.Color3f:
        """Display values in [0, 1] for codes and unit directions."""
        harmonics = [value for direction in directions for value in dr.sh_eval(direction, 3)]
        return mi.Color3f(*(sigmoid(row) for row in network_rows(self._colour, [*code, *harmonics])))


def initial_parameters(
    shapes: Mapping[str, tuple[int, ...]], generator: torch.Generator
) -> dict[str, torch.Tensor]:
    """Leaf tensors to begin with: a table of small values, matrices as of Glorot and Bengio, biases of 0."""

    def bound(name: str, shape: tuple[int, ...]) -> float:
        if name == "table":
            return SMALL
        return weight_bound((shape[0], shape[1])) if len(shape) == 2 else 0.0

    def values(name: str, shape: tuple[int, ...]) -> torch.Tensor:
        most = bound(name, shape)
        return torch.empty(shape).uniform_(-most, most, generator=generator).requires_grad_()

    return {name: values(name, shape) for name, shape in shapes.items()}
