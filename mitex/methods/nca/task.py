"""The image-guided training as a task for the loop (MeshNCA, section 4.1 and supplementary E)."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import torch

from mitex import bridge
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.losses import overflow_loss
from mitex.mesh import icosphere
from mitex.methods.nca.appearance import Appearance
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.perception import perception
from mitex.methods.nca.targets import OFFSET, STATE_CHANNELS, Targets, enlarged, state_layout
from mitex.runtime import keep_freed_memory
from mitex.scenes.cameras import Cameras, orbit, patch_views, random_views
from mitex.scenes.stage import Stage
from mitex.training import Step
from mitex.triples import channel_triples, triple_images


class NcaTask:
    """Trains a cell rule: states from a pool evolve on an icosphere, and their views are compared.

    Args:
        config: settings.
        exemplar: maps to learn.
        init: starting weights, from a model of the same shape; None draws new ones from the seed.
    """

    def __init__(self, config: NcaConfig, exemplar: Exemplar, init: MeshNCA | None = None) -> None:
        keep_freed_memory()
        self.config, self.exemplar = config, exemplar
        self.maps = sorted(exemplar.maps)
        self.model = MeshNCA(config.channels, config.hidden, degree=config.degree)
        self.model.initialise(torch.Generator().manual_seed(config.seed), config.gain)
        if init is not None:
            self.model.load_state_dict(init.state_dict())
        self.mesh = icosphere(config.frequency)
        self.perception = perception(self.mesh, config.degree)
        self.stage = Stage(self.mesh, channels=len(STATE_CHANNELS))
        network = Vgg16(config.pooling)
        target = enlarged(exemplar.resized(config.exemplar_size), config.target_size)
        pictures = channel_triples(state_layout(self.maps), config.blend, config.seed)
        self.appearance = Appearance(config, Targets(target, pictures, network, config.layers), network)
        self.pool = torch.zeros(config.pool, self.perception.vertices, config.channels)
        self._touched = torch.zeros(config.pool, dtype=torch.bool)

    @property
    def parameters(self) -> list[torch.nn.Parameter]:
        return list(self.model.parameters())

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
        state = self.model.evolve(state, self.perception, steps, generator)
        visibility = self.stage.visibility(self.cameras(generator))
        views = bridge.lookup(state[0].index_select(1, self.appearance.channels) + OFFSET, visibility)
        appearance, overflow = self.appearance(views, generator), overflow_loss(state)
        return Step(
            appearance + config.overflow_weight * overflow,
            {"appearance": appearance.item(), "overflow": overflow.item()},
            partial(self._put_back, index, state.detach()[0]),
        )

    def _put_back(self, index: int, state: torch.Tensor) -> None:
        self.pool[index], self._touched[index] = state, True

    def cameras(self, generator: torch.Generator) -> Cameras:
        """The views of one step."""
        config = self.config
        if config.views == "full":
            fov = math.radians(config.fov)
            return random_views(generator, config.view_count, config.distance, fov, config.resolution)
        return patch_views(generator, self.mesh, config.view_count, self.half_width, config.resolution)

    @property
    def pixel(self) -> float:
        """Width of an exemplar's pixel on the sphere [mesh units], from the wanted `density`."""
        edge = math.sqrt(8 * math.pi / math.sqrt(3) / len(self.mesh.vertices))  # of equilateral faces
        return self.config.density * edge / self.config.exemplar_size

    @property
    def half_width(self) -> float:
        """Half the width of a patch view [mesh units]."""
        return 0.5 * self.pixel * self.config.resolution

    def state(self) -> dict[str, torch.Tensor]:
        """Weights, and the pool's states that are no longer the seed."""
        weights = {f"model.{name}": value for name, value in self.model.state_dict().items()}
        return weights | {"pool.touched": self._touched, "pool.states": self.pool[self._touched]}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        weights = {name[6:]: value for name, value in state.items() if name.startswith("model.")}
        self.model.load_state_dict(weights)
        self._touched = state["pool.touched"]
        self.pool.zero_()
        self.pool[self._touched] = state["pool.states"]

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """For each map a row: the exemplar, two patches at its scale, and the whole sphere of an evolved
        state.
        """
        generator = torch.Generator().manual_seed(step)
        state = self.pool[int(torch.randint(self.config.pool, (), generator=generator))][None]
        state = self.model.evolve(state, self.perception, self.config.max_steps, generator)[0] + OFFSET
        size = self.config.exemplar_size
        side = min(size, max(int(1.2 / self.pixel), 1))  # wider patches would look past the sphere
        patches = patch_views(generator, self.mesh, 2, 0.5 * self.pixel * side, side)
        whole = orbit(1, distance=2.05, resolution=2 * size)
        views = [bridge.lookup(state, self.stage.visibility(patches)).numpy()]
        views.append(bridge.lookup(state, self.stage.visibility(whole, antialias=2)).numpy())
        pictures = channel_triples(state_layout(self.maps), False, 0)
        exemplar = self.exemplar.resized(size)
        rows = []
        images = triple_images(exemplar, pictures, STATE_CHANNELS)
        for image, channels in zip(images, (list(p.channels) for p in pictures), strict=True):
            rows.append(_row(image, *(v[..., channels] for v in views)))
        return np.clip(np.concatenate(rows, 0), 0, 1)

    def metadata(self) -> dict[str, str]:
        return {"method": "nca", "maps": ",".join(self.maps), "exemplar": self.exemplar.name}


def _row(exemplar: np.ndarray, patches: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Exemplar twice, two patches (white around them) and the sphere, side by side."""
    space = len(exemplar) - patches.shape[1]
    margin = (space // 2, space - space // 2)
    padded = np.pad(patches, ((0, 0), margin, margin, (0, 0)), constant_values=1.0)
    columns = [np.concatenate([exemplar, exemplar]), np.concatenate(list(padded)), whole[0]]
    return np.concatenate(columns, 1)
