"""The image-guided training as a task for the loop (MeshNCA, section 4.1; Cells2Pixels, section 3.3)."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import torch

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.losses import overflow_loss
from mitex.mesh import Mesh
from mitex.methods.nca.appearance import Appearance
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.spheres import TrainingSphere, training_spheres
from mitex.methods.nca.targets import Targets, enlarged
from mitex.progress import announce
from mitex.runtime import keep_freed_memory
from mitex.scenes.cameras import Cameras, orbit, patch_views, random_views
from mitex.training import Step
from mitex.triples import channel_triples, triple_images

SMALLEST = 64  # side of the exemplar at the coarsest zoom [px], at least
PREVIEW = 256  # side of a preview's pictures [px]
WIDEST = 0.65  # half the side of a patch of the unit sphere: wider ones would look past it


class NcaTask:
    """Trains a look: states from a pool evolve on spheres, and their views are compared at several zooms.

    Args:
        config: settings.
        exemplar: maps to learn.
        init: what to start from; None draws new weights from the seed.
    """

    def __init__(self, config: NcaConfig, exemplar: Exemplar, init: Look | None = None) -> None:
        keep_freed_memory()
        announce("preparing spheres and the exemplar")
        self.config = config
        self.exemplar = exemplar.resized(min(config.exemplar_size, *exemplar.size))
        self.maps = sorted(exemplar.maps)
        self.look = Look.of(config, self.maps)
        if init is None:
            self.look.initialise(torch.Generator().manual_seed(config.seed), config.gain)
        else:
            self.look.load_state_dict(init.state_dict())
        self.spheres = training_spheres(config, self.look)
        self.zooms = self._appearances()
        self.pool = torch.zeros(config.pool, len(self.spheres[0].mesh.vertices), config.channels)
        self._touched = torch.zeros(config.pool, dtype=torch.bool)

    def _appearances(self) -> dict[int, Appearance]:
        """Size of the exemplar [px] -> comparison with it at that size; from the coarsest on."""
        config, network = self.config, Vgg16(self.config.pooling)
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
        state = self.pool[index][None]
        if step % config.inject_every == 0:
            state = torch.zeros_like(state)
        steps = int(torch.randint(config.min_steps, config.max_steps + 1, (), generator=generator))
        sphere = self.sphere(index)
        state = self.look.rule.evolve(state, sphere.perception, steps, generator)
        losses = []
        for size, appearance in self.zooms.items():
            views = sphere.views(self.look, state[0], self.cameras(sphere.mesh, size, generator))
            losses.append(appearance(views, generator))
        appearance, overflow = torch.stack(losses).mean(), overflow_loss(state)
        return Step(
            appearance + config.overflow_weight * overflow,
            {"appearance": appearance.item(), "overflow": overflow.item()},
            partial(self._put_back, index, state.detach()[0]),
        )

    def _put_back(self, index: int, state: torch.Tensor) -> None:
        self.pool[index], self._touched[index] = state, True
        self.look.track(state)

    def sphere(self, index: int) -> TrainingSphere:
        """Where a state of the pool grows."""
        return self.spheres[index % len(self.spheres)]

    def cameras(self, mesh: Mesh, size: int, generator: torch.Generator) -> Cameras:
        """The views of one step in which the exemplar is `size` [px] wide."""
        config = self.config
        if config.views == "full":
            fov = math.radians(config.fov)
            return random_views(generator, config.view_count, config.distance, fov, config.resolution)
        half = min(0.5 * self.width * config.resolution / size, WIDEST)
        return patch_views(generator, mesh, config.view_count, half, config.resolution)

    @property
    def width(self) -> float:
        """Of the exemplar on the sphere [mesh units], from the `density`."""
        edge = math.sqrt(8 * math.pi / math.sqrt(3) / self.pool.shape[1])  # of equilateral faces
        return self.config.density * edge

    def state(self) -> dict[str, torch.Tensor]:
        """Weights, and the pool's states that are no longer the seed."""
        weights = {f"model.{name}": value for name, value in self.look.state_dict().items()}
        return weights | {"pool.touched": self._touched, "pool.states": self.pool[self._touched]}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        weights = {name[6:]: value for name, value in state.items() if name.startswith("model.")}
        self.look.load_state_dict(weights)
        self._touched = state["pool.touched"]
        self.pool.zero_()
        self.pool[self._touched] = state["pool.states"]

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """For each map a row: the exemplar, a patch as wide, a quarter of that, and the whole sphere of an
        evolved state.
        """
        generator = torch.Generator().manual_seed(step)
        index = int(torch.randint(self.config.pool, (), generator=generator))
        sphere, state = self.sphere(index), self.pool[index][None]
        state = self.look.rule.evolve(state, sphere.perception, self.config.max_steps, generator)[0]
        wide = min(0.5 * self.width, WIDEST)
        cameras = [patch_views(generator, sphere.mesh, 1, half, PREVIEW) for half in (wide, wide / 4)]
        cameras.append(orbit(1, distance=2.05, resolution=PREVIEW))
        views = [sphere.views(self.look, state, c, antialias=2)[0].numpy() for c in cameras]
        triples = channel_triples(self.look.layout, False, 0)
        images = triple_images(self.exemplar.resized(PREVIEW), triples, self.look.layout)
        rows = [
            np.concatenate([image, *(view[..., triple.channels] for view in views)], 1)
            for image, triple in zip(images, triples, strict=True)
        ]
        return np.clip(np.concatenate(rows), 0, 1)

    def metadata(self) -> dict[str, str]:
        exemplar = {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        return {"method": "nca", "maps": ",".join(self.maps)} | exemplar
