"""What a fit learns: the rule by which cells grow, and what their states look like."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import asdict
from typing import Any

import torch
from torch import nn

from mitex.cache import content_key
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.decoder import Decoder, Readout
from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.motion.condition import WIDTH
from mitex.methods.nca.perception import Perception
from mitex.progress import announce
from mitex.textures.interpolation import Kind
from mitex.triples import map_layout

RATE = 0.02  # at which the bounds follow a step's
MARGIN = 0.05  # of the bounds' distance, which states of other meshes may have beyond

# Channels of the state that are the maps without a decoder, as in the authors' PBR checkpoints; 3 to 5 are
# hidden.
STATE_CHANNELS: dict[str, tuple[int, ...]] = {
    "albedo": (0, 1, 2),
    "height": (6,),
    "normal": (7, 8, 9),
    "roughness": (10,),
    "ambient_occlusion": (11,),
}


class Look(nn.Module):
    """A cell rule and its decoder.

    Args:
        rule: the rule.
        maps: names of the maps that the look has, sorted.
        shape: of the decoder; None reads the maps from the state's own channels.
        mean: whether cells perceive the mean of their neighbours (see `perception`).
    """

    low: torch.Tensor
    high: torch.Tensor

    def __init__(
        self, rule: MeshNCA, maps: Sequence[str], shape: DecoderShape | None, mean: bool = True
    ) -> None:
        super().__init__()
        self.rule, self.maps, self.mean = rule, tuple(maps), mean
        self.layout = map_layout(maps)
        # Between which a trained rule's states stay; the authors' demo holds them in [-1, 1].
        self.register_buffer("low", torch.full((rule.channels,), -1.0))
        self.register_buffer("high", torch.full((rule.channels,), 1.0))
        if shape is None:
            self.decoder: Decoder | Readout = Readout([c for name in maps for c in STATE_CHANNELS[name]])
        else:
            outputs = sum(len(columns) for columns in self.layout.values())
            self.decoder = Decoder(rule.channels, outputs, shape)

    @staticmethod
    def of(config: NcaConfig, maps: Sequence[str]) -> Look:
        """With the shapes of a config, and no weights yet."""
        condition = WIDTH if config.motion and config.motion_encoding else 0
        rule = MeshNCA(config.channels, config.hidden, condition, config.degree)
        shape = config.decoder_shape if config.decoder else None
        return Look(rule, maps, shape, config.aggregation == "mean")

    @property
    def interpolation(self) -> Kind:
        """Of the states between the vertices."""
        return self.decoder.shape.interpolation if isinstance(self.decoder, Decoder) else "linear"

    @property
    def device(self) -> torch.device:
        """Where its weights are."""
        return self.low.device

    def repeating(self, period: float, edge: float) -> Look:
        """A copy whose local coordinates repeat after `period` in x and y, where edges are `edge` long."""
        look = deepcopy(self)
        if isinstance(look.decoder, Decoder):
            look.decoder.waves = look.decoder.waves.repeating(period, edge)
        return look

    def initialise(self, generator: torch.Generator, gain: float) -> None:
        """Draws weights: the rule's with `gain` in its last layer, then the decoder's."""
        self.rule.initialise(generator, gain)
        if isinstance(self.decoder, Decoder):
            self.decoder.network.initialise(generator)

    @torch.no_grad()
    def track(self, state: torch.Tensor) -> None:
        """Lets the bounds follow the smallest and largest values of a state (V, C) of the training."""
        self.low.lerp_(state.amin(0), RATE)
        self.high.lerp_(state.amax(0), RATE)

    def evolve(
        self,
        state: torch.Tensor,
        operator: Perception,
        steps: int,
        generator: torch.Generator,
        condition: torch.Tensor | None = None,
        advection: Callable[[torch.Tensor], torch.Tensor] | None = None,
    ) -> torch.Tensor:
        """`steps` steps of the rule from a state (B, V, C), held within the bounds after each, before it is
        carried; `condition` and `advection` as of `MeshNCA.evolve`.
        """
        for step in range(steps):
            announce("growing the texture", step, steps)
            state = self.clamp(self.rule.evolve(state, operator, 1, generator, condition))
            state = state if advection is None else advection(state)
        return state

    def clamp(self, state: torch.Tensor) -> torch.Tensor:
        """The state (..., C) held where the training's states were: on meshes unlike the sphere it may grow
        without an end, as nothing has taught the rule to come back.
        """
        return clamp_state(state, self.low, self.high)


def clamp_state(state: torch.Tensor, low: torch.Tensor, high: torch.Tensor) -> torch.Tensor:
    """States (..., C) within bounds (..., C) and a margin beyond them."""
    margin = MARGIN * (high - low)
    return torch.minimum(torch.maximum(state, low - margin), high + margin)


def traits(look: Look) -> dict[str, Any]:
    """What two looks must have in common for the weights of one to mean the same in the other."""
    traits: dict[str, Any] = {"maps": look.maps, "aggregation": look.mean}
    traits |= {name: tuple(value.shape) for name, value in look.state_dict().items()}
    return traits | (asdict(look.decoder.shape) if isinstance(look.decoder, Decoder) else {})


def differing_traits(one: Look, other: Look) -> list[str]:
    """Names of the `traits` that two looks do not have in common, sorted."""
    first, second = traits(one), traits(other)
    return sorted(name for name in first | second if first.get(name) != second.get(name))


def weights_key(look: Look) -> str:
    """A hash of all weights of a look."""
    parts = ((name, value.numpy(force=True)) for name, value in sorted(look.state_dict().items()))
    return content_key(*(part for pair in parts for part in pair))[:12]
