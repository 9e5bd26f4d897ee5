"""Two textures that grow into each other on one mesh (MeshNCA, section 3.3.2).

Both rules see the one state, and each cell's update is theirs mixed: u = (1 - a) u_S + a u_T, with the weight
a of its vertex; where they move, so are their motions, each with its own field, speed and period. The paper's
maps are channels of the state. Ours have decoders, whose weights are mixed likewise: textures of one family
are near enough for a decoder between two of them to be one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from mitex.cache import content_key
from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.methods.nca.decoder.surface import Points
from mitex.methods.nca.embossed import EmbossedTexture
from mitex.methods.nca.growth import Growth, LookGrowth
from mitex.methods.nca.look import clamp_state, differing_traits
from mitex.methods.nca.model import FIRE_RATE
from mitex.methods.nca.motion.condition import Field
from mitex.methods.nca.motion.start import with_condition
from mitex.methods.nca.orientation import Orientation
from mitex.methods.nca.texture import GrowingTexture, NcaTexture
from mitex.methods.nca.weights import Weights
from mitex.progress import announce


@dataclass(frozen=True, eq=False)
class Graft(GrowingTexture):
    """Two textures of one family that grow into each other.

    Where a weight is 0 or 1, cells are those of the single texture, bit for bit; in between, no place is
    healed, as no exemplar says which colours belong there.

    Attributes:
        first: where the weight is 0.
        second: where the weight is 1.
        weights: over the mesh, see `mitex.methods.nca.weights`.

    Raises:
        ConfigError: the two are not of one family.
    """

    first: NcaTexture
    second: NcaTexture
    weights: Weights

    def __post_init__(self) -> None:
        check_related(self.first, self.second)

    @property
    def about(self) -> Mapping[str, Any]:
        first, second = (texture.about.get("name") for texture in (self.first, self.second))
        return {"name": f"{first} and {second}", "family": self.first.family}

    @property
    def density(self) -> float:
        """Of the two, the geometric mean."""
        return math.sqrt(self.first.density * self.second.density)

    @property
    def steps(self) -> int:
        """As many as the slower of the two needs."""
        return max(self.first.steps, self.second.steps)

    def growth_on(
        self,
        cells: Cells,
        base: Mesh,
        orientation: Orientation = 0.0,
        field: Field | None = None,
        speed: float = 1.0,
    ) -> GraftedGrowth:
        place = cells, base, orientation, field, speed
        first, second = (texture.growth_on(*place) for texture in (self.first, self.second))
        return GraftedGrowth(first, second, self.weights(cells.mesh.vertices.astype(np.float64)))


def check_related(first: NcaTexture, second: NcaTexture) -> None:
    """Raises a ConfigError unless two textures are of one family, of rules and decoders of one shape."""
    names = f"'{first.about.get('name')}' and '{second.about.get('name')}'"
    if first.family != second.family:
        raise ConfigError(
            f"{names} are not of one family: their states do not mean the same",
            "train one from the other, or both from one model (fit nca with init=...)",
        )
    # Cells may be told a vector by one alone, as a still one's weights for it would be zero.
    differing = differing_traits(*(with_condition(texture.look) for texture in (first, second)))
    if differing:
        raise ConfigError(f"{names} differ in {', '.join(differing)}", "graft textures that are alike in it")


class GraftedGrowth(Growth):
    """Two looks on one mesh.

    Args:
        first, second: the looks, both on the same `cells`.
        weights: (V,) float32 in [0, 1], the second's share at each vertex of the automaton's mesh.
    """

    def __init__(self, first: LookGrowth, second: LookGrowth, weights: np.ndarray) -> None:
        self.first, self.second, self.cells, self.weights = first, second, first.cells, weights
        self._share = torch.from_numpy(weights)
        self._low = torch.lerp(first.look.low, second.look.low, self._share[:, None])
        self._high = torch.lerp(first.look.high, second.look.high, self._share[:, None])
        self._of_first, self._of_second = self._share < 1, self._share > 0
        share = weights.astype(np.float64)
        self.relief = (1 - share) * first.relief + share * second.relief

    @property
    def key(self) -> str:
        return content_key(self.first.key, self.second.key, self.weights)

    def seed(self) -> torch.Tensor:
        return self.first.seed()

    @torch.no_grad()
    def evolve(self, state: torch.Tensor, steps: int, generator: torch.Generator) -> torch.Tensor:
        for step in range(steps):
            announce("growing the texture", step, steps)
            state = self._step(state[None], generator)[0]
        return state

    def texture(self, state: torch.Tensor) -> GrownTexture:
        parts = self.first.texture(state), self.second.texture(state), self.weights
        if not np.any(self.relief):
            return GrownGraft(*parts)
        return EmbossedGraft(self._displacement, self.moved, *parts)

    def foreign(self, state: torch.Tensor) -> np.ndarray:
        foreign = np.zeros(len(state), bool)
        for growth, own in ((self.first, self.weights == 0), (self.second, self.weights == 1)):
            if own.any():
                foreign |= growth.foreign(state) & own
        return foreign

    def _step(self, state: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        """A step of both rules with one mask, each of the cells that have a share of it.

        The next states are mixed rather than the updates, which is the same but for rounding: with a weight
        of 0 or 1, the state is exactly that of the single rule. So are what the two motions carry to a cell,
        rather than their ways, which are a fraction of an edge.
        """
        mask = torch.rand(state.shape[:2], generator=generator) < FIRE_RATE
        parts = ((self.first, self._of_first), (self.second, self._of_second))
        first, second = (
            growth.look.rule.step(state, growth.operator, mask & own, growth.motion.condition)
            if own.any()
            else state
            for growth, own in parts
        )
        mixed = clamp_state(torch.lerp(first, second, self._share[:, None]), self._low, self._high)
        first, second = (
            mixed if growth.motion.advection is None else growth.motion.advection(mixed)
            for growth in (self.first, self.second)
        )
        return torch.lerp(first, second, self._share[:, None])


class GrownGraft(GrownTexture):
    """A state on an automaton's mesh, as two looks show it, mixed.

    Args:
        first, second: the two looks' own.
        weights: (V,) float32, the second's share at each vertex of the automaton's mesh.
    """

    def __init__(self, first: GrownTexture, second: GrownTexture, weights: np.ndarray) -> None:
        self.look, self.cells, self.orientation = first.look, first.cells, first.orientation
        self.surface, self.table = first.surface, first.table
        self.first, self.second, self.weights = first, second, weights

    def _decoded(self, points: Points) -> np.ndarray:
        """Albedos are held within the colours of either exemplar, and what that gives is mixed."""
        share = torch.from_numpy(self._share(points.face.numpy(), points.barycentric.numpy())[:, None])
        place = self.surface, self.table, points
        own, others = self.first.look.decoder, self.second.look.decoder
        if isinstance(own, Decoder) and isinstance(others, Decoder):
            values = own.mixed(others, *place, share)
        else:  # the maps are channels of the state, for both
            values = own(*place)
        values = values.clamp_(0, 1).numpy()
        first, second = (torch.from_numpy(grown.project(values)) for grown in (self.first, self.second))
        return torch.lerp(first, second, share).numpy()

    def _share(self, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """(P,) of points of the automaton's mesh; exactly that of the corners where they are equal."""
        a, b, c = self.weights[self.cells.mesh.faces[face]].T
        return np.clip(a + barycentric[:, 1] * (b - a) + barycentric[:, 2] * (c - a), 0, 1)


class EmbossedGraft(EmbossedTexture, GrownGraft):
    """The same of looks with reliefs, whose bounds are mixed too; arguments as of `EmbossedTexture`."""
