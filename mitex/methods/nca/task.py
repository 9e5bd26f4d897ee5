"""The image-guided training as a task for the loop (MeshNCA, section 4.1; Cells2Pixels, section 3.3)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
import torch
import torch.nn.functional as F

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.losses import overflow_loss
from mitex.methods.nca.appearance import Appearance
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.relief import Relief
from mitex.methods.nca.surfaces import (
    CloseUps,
    TrainingPlane,
    TrainingSphere,
    TrainingSurface,
    training_surfaces,
)
from mitex.methods.nca.targets import Targets, enlarged
from mitex.progress import announce
from mitex.runtime import available_device, keep_freed_memory
from mitex.scenes.cameras import Cameras, random_views
from mitex.training import Step
from mitex.triples import channel_triples, triple_images

SMALLEST = 128  # side of the exemplar at the coarsest zoom [px], at least: a quarter is left at relu3_1
PREVIEW = 256  # side of a preview's pictures [px]


class Rollout(NamedTuple):
    """A state that has evolved, (1, V, C); what that adds to the loss, by name; and to a step's `commit`."""

    state: torch.Tensor
    terms: dict[str, torch.Tensor]
    commit: Callable[[], None] = lambda: None


class NcaTask:
    """Trains a look: states from a pool evolve on surfaces, and their views are compared at several zooms.

    Args:
        config: settings.
        exemplar: maps to learn.
        init: what to start from; None draws new weights from the seed.
        lineage: name of the model to start from, and its family, for the checkpoint.
    """

    def __init__(
        self,
        config: NcaConfig,
        exemplar: Exemplar,
        init: Look | None = None,
        lineage: Mapping[str, str] | None = None,
    ) -> None:
        device = available_device(config.device)
        keep_freed_memory()
        announce("preparing spheres and the exemplar")
        self.config, self.lineage = config, dict(lineage or {})
        self.exemplar = exemplar.resized(min(config.exemplar_size, *exemplar.size))
        self.maps = sorted(exemplar.maps)
        self.look = Look.of(config, self.maps)
        if init is None:
            self.look.initialise(torch.Generator().manual_seed(config.seed), config.gain)
        else:
            self.look.load_state_dict(init.state_dict())
        self.look.to(device)
        self.surfaces = training_surfaces(config, self.look)
        self.zooms = self._appearances()
        self.relief = None
        if config.relief_weight and {"height", "normal"} <= exemplar.maps.keys():
            self.relief = Relief(self.exemplar, self.look.layout, self.zooms)
        # Rows beyond the cells of a state's surface stay zero.
        most = max(surface.perception.vertices for surface in self.surfaces)
        self.pool = torch.zeros(config.pool, most, config.channels, device=self.look.device)
        self._touched = torch.zeros(config.pool, dtype=torch.bool)

    def _appearances(self) -> dict[int, Appearance]:
        """Size of the exemplar [px] -> comparison with it at that size; from the coarsest on."""
        config, network = self.config, Vgg16(self.config.pooling, device=str(self.look.device))
        layout = self.look.layout
        pictures = channel_triples(layout, config.blend, config.seed)
        finest = self.exemplar.size[0]
        zooms = {}
        for halvings in reversed(range(config.zooms)):
            size = finest >> halvings
            if size < SMALLEST and halvings:
                continue
            target = enlarged(self.exemplar.resized(size), config.target_size or size)
            targets = Targets(target, pictures, layout, network, config.layers)
            zooms[size] = Appearance(config, targets, network, ordered=not zooms)
        return zooms

    @property
    def parameters(self) -> list[torch.nn.Parameter]:
        return list(self.look.parameters())

    def begin(self, step: int, generator: torch.Generator) -> None:
        """Nothing changes before the loss."""

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Appearance and overflow of a state of the pool after some steps; `commit` puts it back, evolved."""
        config = self.config
        index = int(torch.randint(config.pool, (), generator=generator))
        surface, state = self.surface(index), self.grown(index)
        if step % config.inject_every == 0:
            state = torch.zeros_like(state)
        steps = int(torch.randint(config.min_steps, config.max_steps + 1, (), generator=generator))
        rollout = self.rollout(index, state, step, steps, generator)
        state = rollout.state
        terms: dict[str, list[torch.Tensor]] = {"appearance": [], "relief": []}
        for size, appearance in self.zooms.items():
            views = self.views(surface, state[0], size, generator)
            terms["appearance"].append(appearance(views, generator))
            if self.relief and isinstance(surface, TrainingPlane):  # on spheres, "right" turns in a view
                terms["relief"].append(config.relief_weight * self.relief(views, size))
        means = {name: torch.stack(values).mean() for name, values in terms.items() if values}
        means |= {"overflow": overflow_loss(state)} | rollout.terms
        weights = {"overflow": config.overflow_weight}
        return Step(
            torch.stack([weights.get(name, 1.0) * mean for name, mean in means.items()]).sum(),
            {name: mean.item() for name, mean in means.items()},
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

    def views(
        self, surface: TrainingSurface, state: torch.Tensor, size: int, generator: torch.Generator
    ) -> torch.Tensor:
        """The views (K, H, W, C) of one step in which the exemplar is `size` [px] wide."""
        if isinstance(surface, TrainingSphere):
            return surface.views(self.look, state, self.cameras(surface, size, generator))
        return surface.patches(self.look, state, self.closeups(size), generator)

    def cameras(self, sphere: TrainingSphere, size: int, generator: torch.Generator) -> Cameras:
        """The cameras of `views`."""
        config = self.config
        if config.views == "full":
            return random_views(generator, config.view_count, config.distance, config.fov, config.resolution)
        return sphere.cameras(self.closeups(size), generator)

    def closeups(self, size: int) -> CloseUps:
        """Those of one step in which the exemplar is `size` [px] wide."""
        config = self.config
        return CloseUps(config.density * config.resolution / size, config.view_count, config.resolution)

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

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """For each map a row: the exemplar, a patch as wide, a quarter of that, and the whole surface of an
        evolved state.
        """
        generator = torch.Generator().manual_seed(step)
        index = int(torch.randint(self.config.pool, (), generator=generator))
        surface, look = self.surface(index), self.look
        state = self.evolved(index, self.grown(index), self.config.max_steps, generator)[0]
        views = [
            surface.patches(look, state, CloseUps(width, 1, PREVIEW, antialias=2), generator)[0]
            for width in (self.config.density, self.config.density / 4)
        ]
        views = [_padded(view, PREVIEW) for view in (*views, surface.whole(look, state, PREVIEW))]
        triples = channel_triples(self.look.layout, False, 0)
        images = triple_images(self.exemplar.resized(PREVIEW), triples, self.look.layout)
        rows = [
            np.concatenate([image, *(view[..., triple.channels] for view in views)], 1)
            for image, triple in zip(images, triples, strict=True)
        ]
        return np.clip(np.concatenate(rows), 0, 1)

    def metadata(self) -> dict[str, str]:
        exemplar = {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        return {"method": "nca", "maps": ",".join(self.maps)} | exemplar | self.lineage


def _padded(view: torch.Tensor, side: int) -> np.ndarray:
    """A square view (h, h, C) in the middle of (side, side, C) zeros."""
    before = (side - len(view)) // 2
    after = side - len(view) - before
    return F.pad(view, (0, 0, before, after, before, after)).cpu().numpy()
