"""The part of a training of motion that does not depend on what the texture is learned from."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import torch

from mitex.features.flow import FARTHEST, load_estimator
from mitex.losses.advection import advection_residual
from mitex.losses.motion import motion_loss
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.motion.tangent_field import TangentField, random_field
from mitex.methods.nca.motion.views import MotionViews
from mitex.methods.nca.pool import PoolTask, Rollout

FIELD_SEEDS = 2**31
POINTS = 8192  # at which the decoder's values are compared
FLOOR = 0.1  # of residuals: as much as a displacement of a third of a cell, in usual patterns


class MovingPool(PoolTask):
    """States that move along a vector field (MeshNCA, section 4.3).

    The first base of a task; the second tells what still pictures shall look like.

    Args:
        config: settings.
        arguments: of the second base.
    """

    def __init__(self, config: NcaConfig, *arguments: Any) -> None:
        super().__init__(config, *arguments)
        # A state has one field until the seed replaces it, so that the rule learns what becomes of its
        # pattern where the field goes on coming together, or apart. These are the fields' random seeds.
        self.field_seeds = torch.zeros(config.pool, dtype=torch.int64)
        name = config.motion_estimator
        self.estimator = None if name == "advection" else load_estimator(name, self.look.device)

    @abstractmethod
    def motion_views(self, field: TangentField, generator: torch.Generator) -> MotionViews:
        """What an estimator of motions in pictures looks at."""

    def rollout(
        self, index: int, state: torch.Tensor, step: int, steps: int, generator: torch.Generator
    ) -> Rollout:
        config, field_seed, seed = self.config, self.field_seeds[index], not state.any()
        if seed:
            field_seed = torch.randint(FIELD_SEEDS, (), generator=generator)
        field = self.field(index, field_seed)
        apart, views = min(config.motion_steps, steps), None
        if self.estimator:
            views = self.motion_views(field, generator)
            apart = min(apart, views.steps_within(FARTHEST, config.motion_period))
        grow = self._growth(field, generator)
        states = [grow(state, steps % apart)]
        for _ in range(steps // apart):
            states.append(grow(states[-1], apart))
        terms = {}
        if not seed and step >= config.motion_start:  # else there is no pattern yet that could move
            sequence = [state[0] for state in states]
            if views:
                loss = self.picture_loss(sequence, views, apart)
            else:
                loss = self.state_residual(sequence, field, apart, generator)
            terms = {"motion": config.motion_weight * loss}
        return Rollout(states[-1], terms, partial(self._keep, index, field_seed))

    def evolved(
        self, index: int, state: torch.Tensor, steps: int, generator: torch.Generator
    ) -> torch.Tensor:
        return self._growth(self.field(index, self.field_seeds[index]), generator)(state, steps)

    def field(self, index: int, field_seed: torch.Tensor) -> TangentField:
        """How the pool's state `index` moves, given its field's random seed."""
        return random_field(self.config, self.surface(index), torch.Generator().manual_seed(int(field_seed)))

    def _growth(
        self, field: TangentField, generator: torch.Generator
    ) -> Callable[[torch.Tensor, int], torch.Tensor]:
        """Of states (1, V, C), by so many steps, along a field."""
        rule, operator = self.look.rule, field.surface.perception
        condition = field.condition.to(self.look.device) if rule.condition else None
        advection = field.advection(1 / self.config.motion_period) if self.config.motion_advection else None
        return lambda state, steps: rule.evolve(state, operator, steps, generator, condition, advection)

    def _keep(self, index: int, field_seed: torch.Tensor) -> None:
        self.field_seeds[index] = field_seed

    def state(self) -> dict[str, torch.Tensor]:
        # The name is that of earlier checkpoints, which can be resumed so.
        return super().state() | {"pool.ways": self.field_seeds}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        super().load_state(state)
        self.field_seeds = state["pool.ways"]

    def state_residual(
        self, states: Sequence[torch.Tensor], field: TangentField, apart: int, generator: torch.Generator
    ) -> torch.Tensor:
        """How far states (V, C), each `apart` automaton steps from the next, are from moving with a field."""
        share = apart / self.config.motion_period
        advection = field.advection(share)
        residuals = [advection_residual(a, b, advection(a), FLOOR) for a, b in pairwise(states)]
        return torch.stack(residuals).mean() + self._decoded_residual(
            states[-2], states[-1], field, share, generator
        )

    def picture_loss(self, states: Sequence[torch.Tensor], views: MotionViews, apart: int) -> torch.Tensor:
        """The same of the last two states, by what views show of them."""
        assert self.estimator is not None
        flow = self.estimator(views.grey(states[-2].detach()), views.grey(states[-1]))
        period, gamma = self.config.motion_period, self.config.motion_gamma
        return motion_loss(flow, views.target, views.mask, steps=apart, period=period, gamma=gamma).total

    def _decoded_residual(
        self,
        before: torch.Tensor,
        after: torch.Tensor,
        field: TangentField,
        share: float,
        generator: torch.Generator,
    ) -> torch.Tensor:
        """The residual of what two states (V, C) show at random points: grain that stays in place costs."""
        points, upstream = field.random_places(POINTS, share, generator)
        surface, decoder = field.surface.surface, self.look.decoder
        table = field.table(before)
        with torch.no_grad():
            there, here = (decoder(surface, table, where) for where in (upstream, points))
        return advection_residual(here, decoder(surface, field.table(after), points), there, FLOOR)
