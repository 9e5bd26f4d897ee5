"""The training of a reaction, on a square whose borders are joined, as a task (Mordvintsev et al. 2021)."""

from __future__ import annotations

from functools import partial

import numpy as np
import torch

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.losses import overflow_loss
from mitex.losses.gram import gram_distance, gram_targets
from mitex.methods.baselines.reaction_diffusion.config import ReactionDiffusionConfig
from mitex.methods.baselines.reaction_diffusion.laplacian import grid_laplacian
from mitex.methods.baselines.reaction_diffusion.reaction import BOUND, Reaction, colours, geometric_rates
from mitex.methods.exemplar_pictures import albedo, framed
from mitex.runtime import keep_freed_memory, mixed_precision
from mitex.sparse import LinearMap
from mitex.training import ParameterTask, Step

PREVIEW_STEPS = 300  # of time, from a new start


class ReactionDiffusionTask(ParameterTask):
    """Weights of a reaction, and a pool of states that have evolved so far.

    Args:
        config: settings.
        exemplar: whose albedo the first three chemicals shall look like.
    """

    def __init__(self, config: ReactionDiffusionConfig, exemplar: Exemplar) -> None:
        keep_freed_memory()
        self.config, self.exemplar = config, exemplar
        generator = torch.Generator().manual_seed(config.seed)
        rates = geometric_rates(config.slowest, config.fastest, config.channels)
        self.reaction = Reaction.random(config.channels, config.hidden, rates, generator)
        super().__init__(self.reaction.tensors)
        self.laplacian = LinearMap(grid_laplacian(config.grid))
        self.pool = torch.stack([self._start(generator) for _ in range(config.pool)])
        self.network = Vgg16()
        picture = albedo(exemplar, config.exemplar_size)
        self.targets = gram_targets(self.network.features(picture[None], config.layers))

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Gram matrices and overflow of a state of the pool after some time; `commit` puts it back."""
        config = self.config
        index = int(torch.randint(config.pool, (), generator=generator))
        state = self._start(generator) if step % config.inject_every == 0 else self.pool[index]
        steps = int(torch.randint(config.min_steps, config.max_steps + 1, (), generator=generator))
        with mixed_precision():
            state = self.reaction.evolve(state, self.laplacian, steps)
        # An overflowing state would outweigh all else, by the fourth power of its values.
        picture = self._picture(state.clamp(-1, 1))
        grams = self.network.grams(picture[None], self.targets)
        terms = {"gram": gram_distance(grams, self.targets), "overflow": overflow_loss(state)}
        return Step(
            terms["gram"] + config.overflow_weight * terms["overflow"],
            {name: value.item() for name, value in terms.items()},
            partial(self._keep, index, state.detach()),
        )

    def _keep(self, index: int, state: torch.Tensor) -> None:
        """Puts a state back into the pool, unless it has exploded."""
        if state.abs().max() <= BOUND:
            self.pool[index] = state

    def state(self) -> dict[str, torch.Tensor]:
        return super().state() | {"pool": self.pool}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        super().load_state(state)
        self.pool.copy_(state["pool"])

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """The exemplar, and what grows from a new start."""
        state = self._start(torch.Generator().manual_seed(step))
        grown = self._picture(self.reaction.evolve(state, self.laplacian, PREVIEW_STEPS)).clamp(0, 1).numpy()
        return np.hstack([framed(self.exemplar, self.config.exemplar_size, self.config.grid), grown])

    def metadata(self) -> dict[str, str]:
        exemplar = {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        return {"method": "reaction_diffusion"} | exemplar

    def _start(self, generator: torch.Generator) -> torch.Tensor:
        return self.reaction.start(self.config.grid**2, self.laplacian, generator)

    def _picture(self, state: torch.Tensor) -> torch.Tensor:
        """(N, N, 3) sRGB."""
        return colours(state).view(self.config.grid, self.config.grid, 3)
