"""An automaton at work on a mesh: how its states evolve, and what they show."""

from __future__ import annotations

from abc import ABC, abstractmethod
from copy import copy
from functools import cached_property
from typing import Self

import numpy as np
import torch

from mitex.cache import content_key
from mitex.errors import ConfigError
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.surface import Surface
from mitex.methods.nca.displacement import Displacement
from mitex.methods.nca.embossed import EmbossedTexture
from mitex.methods.nca.look import Look, weights_key
from mitex.methods.nca.motion.cell_motion import STILL, CellMotion
from mitex.methods.nca.orientation import Turn
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.perception import Perception, perception
from mitex.runtime import keep_freed_memory


class Growth(ABC):
    """What grows on the mesh of an automaton.

    Attributes:
        cells: the mesh.
        relief: how far the height moves the surface at most [edges], everywhere or (V,); 0 if it is a map and
            no more.
        moved: whether the relief moves the mesh.
    """

    cells: Cells
    relief: float | np.ndarray = 0.0
    moved = False

    @property
    @abstractmethod
    def key(self) -> str:
        """A hash of all that its states, and what they show, follow from, beside their number and a random
        seed.
        """

    @abstractmethod
    def seed(self) -> torch.Tensor:
        """The initial state, zeros (V, C)."""

    @abstractmethod
    def evolve(self, state: torch.Tensor, steps: int, generator: torch.Generator) -> torch.Tensor:
        """The state (V, C) after some steps, held within the bounds of the training."""

    @abstractmethod
    def texture(self, state: torch.Tensor) -> GrownTexture:
        """What a state (V, C) looks like on the mesh that the texture is for."""

    def displaced(self) -> Self:
        """The same on a mesh that its relief moves.

        Raises:
            ConfigError: it has no relief.
        """
        if not np.any(self.relief):
            raise ConfigError("the texture has no relief that could displace a mesh", "train one from words")
        growth = copy(self)
        growth.moved = True
        return growth

    @cached_property
    def _displacement(self) -> Displacement:
        return Displacement(self.cells.mesh, self.relief)

    @abstractmethod
    def foreign(self, state: torch.Tensor) -> np.ndarray:
        """The vertices (V,) bool at which a state shows colours that the exemplar does not have."""


class LookGrowth(Growth):
    """A single look on a mesh.

    Args:
        look: the cell rule and its decoder.
        cells: the mesh.
        orientation: of the texture.
        palette: the exemplar's colours; None if they are not known.
        operator: perception of the cells, if it is not simply that of their mesh.
        motion: of the cells.
        relief: how far the height moves the surface at most [edges]; 0 if it is a map and no more.
    """

    def __init__(
        self,
        look: Look,
        cells: Cells,
        orientation: Turn = 0.0,
        palette: Palette | None = None,
        operator: Perception | None = None,
        motion: CellMotion = STILL,
        relief: float = 0.0,
    ) -> None:
        self.motion, self.relief = motion, relief
        self.look, self.cells, self.orientation, self.palette = look, cells, orientation, palette
        self.operator = operator or perception(cells.mesh, look.rule.degree, orientation, mean=look.mean)

    @property
    def key(self) -> str:
        place = self.cells.mesh.vertices, self.cells.mesh.faces, np.asarray(self.orientation)
        palette = () if self.palette is None else (self.palette.colours, self.palette.radius)
        shown = weights_key(self.look), self.relief
        return content_key(shown, *palette, *place, *self.motion.arrays)

    def seed(self) -> torch.Tensor:
        return self.look.rule.seed(self.operator)[0]

    @torch.no_grad()
    def evolve(self, state: torch.Tensor, steps: int, generator: torch.Generator) -> torch.Tensor:
        motion = self.motion.condition, self.motion.advection
        return self.look.evolve(state[None], self.operator, steps, generator, *motion)[0]

    def texture(self, state: torch.Tensor) -> GrownTexture:
        parts = (self.look, state, self.cells, self.orientation, self.palette, self._surface)
        return (
            EmbossedTexture(self._displacement, self.moved, *parts) if self.relief else GrownTexture(*parts)
        )

    def foreign(self, state: torch.Tensor) -> np.ndarray:
        if self.palette is None:
            return np.zeros(len(state), bool)
        own = Cells(self.cells.mesh, 0, self.cells.mesh)
        grown = GrownTexture(self.look, state, own, surface=self._surface)
        return self.palette.unlike(grown.at_vertices()["albedo"])

    @cached_property
    def _surface(self) -> Surface:
        return Surface(self.cells.mesh, self.look.interpolation)


def grown_state(growth: Growth, seed: int, steps: int) -> torch.Tensor:
    """The state (V, C) after some steps from the initial one, with random updates from a seed.

    Raises:
        ConfigError: steps below 0.
    """
    if steps < 0:
        raise ConfigError(f"{steps} steps", "give 0 or more")
    keep_freed_memory()
    return growth.evolve(growth.seed(), steps, torch.Generator().manual_seed(seed))
