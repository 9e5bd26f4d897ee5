"""The training of a look that moves: the still one, along a field that differs from step to step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import torch

from mitex.exemplar import Exemplar
from mitex.losses.advection import advection_residual
from mitex.losses.motion import motion_loss
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.motion.drift import Drift, draw_drift
from mitex.methods.nca.motion.estimator import load_estimator
from mitex.methods.nca.motion.pairs import Pairs, plane_pairs, sphere_pairs
from mitex.methods.nca.surfaces import TrainingSphere, TrainingSurface
from mitex.methods.nca.task import NcaTask, Rollout

POINTS = 8192  # at which the decoder's values are compared
FLOOR = 0.1  # of residuals: as much as a way of a third of a cell, in usual patterns


class MotionTask(NcaTask):
    """Trains a look that moves along a vector field (MeshNCA, section 4.3); arguments as of `NcaTask`."""

    def __init__(
        self,
        config: NcaConfig,
        exemplar: Exemplar,
        init: Look | None = None,
        lineage: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(config, exemplar, init, lineage)
        self.estimator = load_estimator(config.motion_estimator, self.look.device)

    def rollout(
        self,
        surface: TrainingSurface,
        state: torch.Tensor,
        step: int,
        steps: int,
        generator: torch.Generator,
    ) -> Rollout:
        config, rule = self.config, self.look.rule
        drift = draw_drift(config, surface, generator)
        condition = self._told(drift)
        apart = min(config.motion_steps, steps)
        pattern = bool(state.any()) and step >= config.motion_start
        states = [rule.evolve(state, surface.perception, steps % apart, generator, condition)]
        for _ in range(steps // apart):
            states.append(rule.evolve(states[-1], surface.perception, apart, generator, condition))
        if not pattern:  # nothing can move yet
            return Rollout(states[-1], {})
        loss = self.motion([state[0] for state in states], drift, apart, generator)
        return Rollout(states[-1], {"motion": config.motion_weight * loss})

    def evolved(
        self, surface: TrainingSurface, state: torch.Tensor, steps: int, generator: torch.Generator
    ) -> torch.Tensor:
        condition = self._told(draw_drift(self.config, surface, generator))
        return self.look.rule.evolve(state, surface.perception, steps, generator, condition)

    def _told(self, drift: Drift) -> torch.Tensor | None:
        """The condition of the cells."""
        return drift.condition.to(self.look.device) if self.look.rule.condition else None

    def motion(
        self, states: Sequence[torch.Tensor], drift: Drift, apart: int, generator: torch.Generator
    ) -> torch.Tensor:
        """How far states (V, C), each `apart` automaton steps from the next, are from moving with a drift."""
        period, gamma = self.config.motion_period, self.config.motion_gamma
        if self.estimator is None:
            transport = drift.transport(apart / period)
            residuals = [advection_residual(a, b, transport(a), FLOOR) for a, b in pairwise(states)]
            shown = self._shown(states[-2].detach(), states[-1], drift, apart / period, generator)
            return torch.stack(residuals).mean() + shown
        pairs = self.pairs((states[-2].detach(), states[-1]), drift, generator)
        flow = self.estimator(pairs.first, pairs.second)
        return motion_loss(flow, pairs.target, pairs.mask, steps=apart, period=period, gamma=gamma).total

    def _shown(
        self,
        before: torch.Tensor,
        after: torch.Tensor,
        drift: Drift,
        share: float,
        generator: torch.Generator,
    ) -> torch.Tensor:
        """The residual of what two states (V, C) show at random points: grain that stays in place costs."""
        points, upstream = drift.random_places(POINTS, share, generator)
        surface, decoder = drift.surface.surface, self.look.decoder
        table = drift.table(before)
        with torch.no_grad():
            there, here = (decoder(surface, table, where) for where in (upstream, points))
        return advection_residual(here, decoder(surface, drift.table(after), points), there, FLOOR)

    def pairs(self, states: Sequence[torch.Tensor], drift: Drift, generator: torch.Generator) -> Pairs:
        """What the estimator looks at: the widest views, in which motions are the fewest pixels."""
        surface, size = drift.surface, next(iter(self.zooms))
        if isinstance(surface, TrainingSphere):
            return sphere_pairs(self.look, states, drift, self.cameras(surface, size, generator))
        windows = surface.places(self.closeups(size), generator)
        return plane_pairs(self.look, states, drift, windows)
