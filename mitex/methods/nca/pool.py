"""What every training of a look does: states from a pool evolve on surfaces, and losses look at them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import torch

from mitex.losses import overflow_loss
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.surfaces import TrainingSurface
from mitex.training import Step


class Rollout(NamedTuple):
    """A state that has evolved, (1, V, C); what that adds to the loss, by name; and to a step's `commit`."""

    state: torch.Tensor
    terms: dict[str, torch.Tensor]
    commit: Callable[[], None] = lambda: None


class PoolTask(ABC):
    """The part of a training that does not depend on what the texture is learned from.

    Args:
        config: settings.
        look: what learns.
        surfaces: that states grow on in turns.
        lineage: name of the model that the look started from, and its family, for the checkpoint.
    """

    def __init__(
        self,
        config: NcaConfig,
        look: Look,
        surfaces: Sequence[TrainingSurface],
        lineage: Mapping[str, str] | None = None,
    ) -> None:
        self.config, self.look, self.surfaces, self.lineage = config, look, surfaces, dict(lineage or {})
        # Rows beyond the cells of a state's surface stay zero.
        most = max(surface.perception.vertices for surface in surfaces)
        self.pool = torch.zeros(config.pool, most, config.channels, device=look.device)
        self._touched = torch.zeros(config.pool, dtype=torch.bool)

    @property
    def parameters(self) -> list[torch.nn.Parameter]:
        return list(self.look.parameters())

    def begin(self, step: int, generator: torch.Generator) -> None:
        """Nothing changes before the loss."""
        return None

    @abstractmethod
    def terms(
        self, surface: TrainingSurface, state: torch.Tensor, generator: torch.Generator
    ) -> dict[str, torch.Tensor]:
        """What a state (V, C) on a surface adds to the loss, by name."""

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """The terms and overflow of a state of the pool after some steps; `commit` puts it back, evolved."""
        config = self.config
        index = int(torch.randint(config.pool, (), generator=generator))
        state = self.grown(index)
        if step % config.inject_every == 0:
            state = torch.zeros_like(state)
        steps = int(torch.randint(config.min_steps, config.max_steps + 1, (), generator=generator))
        rollout = self.rollout(index, state, step, steps, generator)
        state = rollout.state
        terms = self.terms(self.surface(index), state[0], generator)
        terms |= {"overflow": overflow_loss(state)} | rollout.terms
        weights = {"overflow": config.overflow_weight}
        return Step(
            torch.stack([weights.get(name, 1.0) * term for name, term in terms.items()]).sum(),
            {name: term.item() for name, term in terms.items()},
            partial(self._commit, index, state.detach()[0], rollout.commit),
        )

    def rollout(
        self, index: int, state: torch.Tensor, step: int, steps: int, generator: torch.Generator
    ) -> Rollout:
        """What becomes of a state (1, V, C) of the pool, or the seed in its place, in a training step."""
        return Rollout(self.evolved(index, state, steps, generator), {})

    def evolved(
        self, index: int, state: torch.Tensor, steps: int, generator: torch.Generator
    ) -> torch.Tensor:
        """A state (1, V, C) after some steps of the rule, on the surface of the pool's state `index`."""
        return self.look.rule.evolve(state, self.surface(index).perception, steps, generator)

    def _commit(self, index: int, state: torch.Tensor, further: Callable[[], None]) -> None:
        self.pool[index, : len(state)], self._touched[index] = state, True
        self.look.track(state)
        further()

    def surface(self, index: int) -> TrainingSurface:
        """Where a state of the pool grows."""
        return self.surfaces[index % len(self.surfaces)]

    def grown(self, index: int) -> torch.Tensor:
        """A state of the pool, (1, V, C)."""
        return self.pool[index][None, : self.surface(index).perception.vertices]

    def example(self, step: int) -> tuple[TrainingSurface, torch.Tensor, torch.Generator]:
        """For a preview: a surface, a state (V, C) of the pool that has evolved on it, and random numbers."""
        generator = torch.Generator().manual_seed(step)
        index = int(torch.randint(self.config.pool, (), generator=generator))
        state = self.evolved(index, self.grown(index), self.config.max_steps, generator)[0]
        return self.surface(index), state, generator

    def state(self) -> dict[str, torch.Tensor]:
        """Weights, and the pool's states that are no longer the seed."""
        weights = {f"model.{name}": value for name, value in self.look.state_dict().items()}
        return weights | {"pool.touched": self._touched, "pool.states": self.pool[self._touched]}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        weights = {name[6:]: value for name, value in state.items() if name.startswith("model.")}
        self.look.load_state_dict(weights)
        self._touched = state["pool.touched"]
        self.pool.zero_()
        self.pool[self._touched] = state["pool.states"].to(self.pool.device)


def initial_look(config: NcaConfig, maps: Sequence[str], init: Look | None, device: str) -> Look:
    """A look of the config's shape: with the weights of `init`, or new ones from the config's seed."""
    look = Look.of(config, maps)
    if init is None:
        look.initialise(torch.Generator().manual_seed(config.seed), config.gain)
    else:
        look.load_state_dict(init.state_dict())
    return look.to(device)
