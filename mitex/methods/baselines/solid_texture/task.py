"""The training of a solid texture, on slices through it, as a task (Gutierrez et al. 2020, section 4)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import torch

from mitex.exemplar import Exemplar
from mitex.features.layers import CHANNELS
from mitex.features.vgg19 import named_vgg
from mitex.losses.gram import gram_distance, gram_targets
from mitex.methods.baselines.solid_texture.boxes import Box
from mitex.methods.baselines.solid_texture.config import SolidConfig
from mitex.methods.baselines.solid_texture.generator import NOISE, SCALES, Generator, noise_boxes
from mitex.methods.exemplar_pictures import albedo, framed
from mitex.runtime import keep_freed_memory
from mitex.training import ParameterTask, Step

SETTLING = 10  # slices across each axis, by which statistics come from the last weights
SHIFTS = 1 << (SCALES - 1)  # places of a slice among the voxels of the coarsest scale


class SolidTask(ParameterTask):
    """A generator whose slices across the three axes shall have the Gram matrices of an exemplar.

    The authors take VGG-19, for which VGG-16 stands in, whose weights come with Mitex. They draw the place of
    a slice along its axis alone, here it is drawn along all three.

    Args:
        config: settings.
        exemplar: whose albedo all slices shall look like.
    """

    def __init__(self, config: SolidConfig, exemplar: Exemplar) -> None:
        keep_freed_memory()
        self.config, self.exemplar = config, exemplar
        self.generator = Generator.random(torch.Generator().manual_seed(config.seed))
        super().__init__(self.generator.tensors)
        self.network = named_vgg(config.network, normalised=config.normalised)
        # Published matrices are divided by the channels C, so that their squared distance is C^2 smaller.
        self.weights = None if config.normalised else {name: CHANNELS[name] ** -2 for name in config.layers}
        picture = albedo(exemplar, config.exemplar_size)
        self.targets = gram_targets(self.network.features(picture[None], config.layers))

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Gram matrices of slices across x, y and z; `commit` keeps the statistics of the channels."""
        updated = {name: value.clone() for name, value in self.generator.statistics.items()}
        total = torch.zeros(())
        for axis in range(3):
            slices = [self._slice(axis, generator, updated) for _ in range(self.config.slices)]
            grams = self.network.grams(torch.stack(slices), self.targets)
            total = total + gram_distance(grams, self.targets, self.weights) / 3
        return Step(total, {}, partial(self._keep, updated))

    def state(self) -> dict[str, torch.Tensor]:
        return super().state() | {f"statistics/{k}": v for k, v in self.generator.statistics.items()}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        super().load_state(state)
        self._keep({name: state[f"statistics/{name}"] for name in self.generator.statistics})

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """The exemplar, and slices across x, y and z."""
        generator = torch.Generator().manual_seed(step)
        updated = {name: value.clone() for name, value in self.generator.statistics.items()}
        slices = [self._slice(axis, generator, updated).clamp(0, 1).numpy() for axis in range(3)]
        return np.hstack([framed(self.exemplar, self.config.exemplar_size, len(slices[0])), *slices])

    @torch.no_grad()
    def settled(self) -> Generator:
        """The generator with statistics of its present weights; those of the training lag behind."""
        generator = torch.Generator().manual_seed(self.config.seed)
        updated = {name: value.clone() for name, value in self.generator.statistics.items()}
        for _ in range(SETTLING):
            for axis in range(3):
                self._slice(axis, generator, updated)
        return replace(self.generator, statistics=updated)

    def metadata(self) -> dict[str, str]:
        return {
            "method": "solid_texture",
            "exemplar": self.exemplar.name,
            "exemplar_key": self.exemplar.key,
        }

    def _slice(self, axis: int, generator: torch.Generator, updated: dict[str, torch.Tensor]) -> torch.Tensor:
        """(N, N, 3) sRGB of one voxel's slice across an axis, at a random place, normalised by itself; moves
        the statistics."""
        side = self.config.slice_size
        start = torch.randint(0, SHIFTS, (3,), generator=generator).tolist()
        box = Box(tuple(start), tuple(1 if k == axis else side for k in range(3)))
        noise = [torch.rand(1, NOISE, *b.size, generator=generator) for b in noise_boxes(box)]
        colours = self.generator.colours(box, noise, updated)
        return colours[0].squeeze(1 + axis).movedim(0, -1).contiguous()

    def _keep(self, statistics: dict[str, torch.Tensor]) -> None:
        for name, value in self.generator.statistics.items():
            value.copy_(statistics[name])
