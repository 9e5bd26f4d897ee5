"""The networks of a box: density and colour of points in [-1, 1]^3, under a light from some direction.

The published one reads sines and cosines of the place; the other reads a hash grid (Mueller et al. 2022), and
learns in minutes what takes the former days without a GPU.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import torch
import torch.nn.functional as F

from mitex.bridge import call
from mitex.methods.baselines.nerf_tex.config import NerfTexConfig
from mitex.methods.nerf.field.decoder import HIGHEST
from mitex.methods.nerf.field.grid_networks import GridLayout, GridNetworks, initial_parameters
from mitex.methods.nerf.field.hash_grid import HashGrid
from mitex.methods.nerf.field.tensors import channels, rows, tensor
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload

LEVELS, COARSEST, FINEST = 8, 16, 256  # of the hash grid

WIDTH, LAYERS, SKIP, BRANCH = 256, 8, 4, 128  # of the published network
PLACE_OCTAVES, DIRECTION_OCTAVES = 10, 4
CHUNK = 1 << 15  # points that it is asked for at a time

Parameters = Mapping[str, torch.Tensor]


@dataclass
class Inputs:
    """N places in the box, as Dr.Jit arrays.

    Attributes:
        points: `mi.Point3f` in [-1, 1]^3.
        view: `mi.Vector3f`, unit directions in which they are seen.
        light: `mi.Vector3f`, unit directions that most light comes from.
    """

    points: mi.Point3f
    view: mi.Vector3f
    light: mi.Vector3f


class Evaluator(Protocol):
    """A network with its parameters."""

    def __call__(self, inputs: Inputs) -> tuple[mi.Float, mi.Color3f]:
        """Density and colours of N places."""
        ...


class Network(ABC):
    """Density [1 / units of the box] and display colours in [0, 1]; parameters come with each call."""

    shapes: Mapping[str, tuple[int, ...]]

    def initial(self, generator: torch.Generator) -> dict[str, torch.Tensor]:
        """Leaf tensors to begin with, as of `initial_parameters`."""
        return initial_parameters(self.shapes, generator)

    @abstractmethod
    def attached(self, parameters: Parameters, inputs: Inputs) -> tuple[torch.Tensor, torch.Tensor]:
        """Density (N,) and colours (N, 3), attached to the parameters."""

    @abstractmethod
    def evaluator(self, parameters: Parameters) -> Evaluator:
        """The same without derivatives, faster, as Dr.Jit arrays."""


class HashNetwork(Network):
    """A hash grid, a network for the density and one for the colour.

    Args:
        table: binary logarithm of the entries of a level.
    """

    def __init__(self, table: int) -> None:
        self.layout = GridLayout(HashGrid(LEVELS, COARSEST, FINEST, table), directions=2)
        self.shapes = self.layout.shapes

    def attached(self, parameters: Parameters, inputs: Inputs) -> tuple[torch.Tensor, torch.Tensor]:
        def run(table: mi.TensorXf, *matrices: mi.TensorXf) -> tuple[mi.TensorXf, mi.TensorXf]:
            density, colours = _values(GridNetworks(self.layout, table.array, matrices), inputs)
            return tensor(density), tensor(colours)

        return call(run, *parameters.values())

    def evaluator(self, parameters: Parameters) -> Evaluator:
        networks = GridNetworks.packed(self.layout, parameters)
        return lambda inputs: _values(networks, inputs)


class FrequencyNetwork(Network):
    """The published network: 8 layers of 256, the place joins once more after layer 4, counted from 0.

    What tells of appearance, here the light's direction, joins the branch of the colour, as the view does.
    """

    def __init__(self) -> None:
        place, direction = (3 + 6 * octaves for octaves in (PLACE_OCTAVES, DIRECTION_OCTAVES))
        inputs = [place] + [WIDTH + (place if layer == SKIP else 0) for layer in range(LAYERS - 1)]
        layers = {f"trunk/{k}": (WIDTH, count) for k, count in enumerate(inputs)}
        layers |= {
            "density": (1, WIDTH),
            "code": (WIDTH, WIDTH),
            "branch": (BRANCH, WIDTH + 2 * direction),
            "colour": (3, BRANCH),
        }
        self.shapes = {}
        for name, shape in layers.items():
            self.shapes |= {f"{name}/weight": shape, f"{name}/bias": shape[:1]}

    def attached(self, parameters: Parameters, inputs: Inputs) -> tuple[torch.Tensor, torch.Tensor]:
        places, view, light = (torch.from_numpy(rows(v)) for v in (inputs.points, inputs.view, inputs.light))
        return self(parameters, places, view, light)

    def evaluator(self, parameters: Parameters) -> Evaluator:
        fixed = {name: value.detach() for name, value in parameters.items()}

        def evaluate(inputs: Inputs) -> tuple[mi.Float, mi.Color3f]:
            values = [torch.from_numpy(rows(v)) for v in (inputs.points, inputs.view, inputs.light)]
            with torch.no_grad():
                parts = zip(*(value.split(CHUNK) for value in values), strict=True)
                density, colour = (torch.cat(v) for v in zip(*(self(fixed, *p) for p in parts), strict=True))
            return upload(mi.Float, density.numpy()), channels(mi.Color3f, colour.numpy())

        return evaluate

    def __call__(
        self, parameters: Parameters, points: torch.Tensor, view: torch.Tensor, light: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Density (N,) and colours (N, 3) of places (N, 3) and unit directions (N, 3)."""

        def layer(name: str, values: torch.Tensor) -> torch.Tensor:
            return F.linear(values, parameters[f"{name}/weight"], parameters[f"{name}/bias"])

        place = frequencies(points, PLACE_OCTAVES)
        values = place
        for k in range(LAYERS):
            values = F.relu(layer(f"trunk/{k}", values))
            if k == SKIP:
                values = torch.cat([place, values], 1)
        density = layer("density", values)[:, 0].clamp(max=HIGHEST).exp()
        directions = [frequencies(direction, DIRECTION_OCTAVES) for direction in (view, light)]
        branch = F.relu(layer("branch", torch.cat([layer("code", values), *directions], 1)))
        return density, torch.sigmoid(layer("colour", branch))


def _values(networks: GridNetworks, inputs: Inputs) -> tuple[mi.Float, mi.Color3f]:
    density, code = networks.density(inputs.points)
    return density, networks.colour(code, inputs.view, inputs.light)


def frequencies(values: torch.Tensor, octaves: int) -> torch.Tensor:
    """Values (N, 3), and their sines and cosines at octaves from pi on: (N, 3 + 6 octaves)."""
    angles = [values * (torch.pi * 2.0**octave) for octave in range(octaves)]
    return torch.cat([values, *(wave(angle) for angle in angles for wave in (torch.sin, torch.cos))], 1)


def network_of(config: NerfTexConfig) -> Network:
    """The network that the settings name."""
    return HashNetwork(config.table) if config.network == "hash" else FrequencyNetwork()
