"""A flat picture whose features have an exemplar's Gram matrices, as a task (Gatys et al. 2015)."""

from __future__ import annotations

import numpy as np
import torch
from torch.nn.functional import pad

from mitex.exemplar import Exemplar
from mitex.features.frozen import GramTap
from mitex.features.layers import halvings
from mitex.features.vgg19 import named_vgg
from mitex.losses.gram import gram_distance, gram_targets
from mitex.methods.baselines.gatys.config import GatysConfig
from mitex.methods.exemplar_pictures import albedo, framed
from mitex.runtime import keep_freed_memory
from mitex.training import ParameterTask, Step

AROUND = 64  # pixels by which a periodic picture is continued; deeper layers see little beyond


class GatysTask(ParameterTask):
    """Pixels, that start as noise.

    The paper takes VGG-19 with its weights scaled to a mean activation of one; here it is VGG-16, scaled
    alike, unless there is a file of VGG-19, whose layers are scaled by their means on the exemplar. All pool
    by means. Colours stay in [0, 1], where the authors bound them by the exemplar's darkest and brightest.

    Args:
        config: settings.
        exemplar: whose albedo is matched.
    """

    def __init__(self, config: GatysConfig, exemplar: Exemplar) -> None:
        keep_freed_memory()
        self.config, self.exemplar = config, exemplar
        generator = torch.Generator().manual_seed(config.seed)
        picture = albedo(exemplar, config.exemplar_size)
        noise = torch.rand(config.size, config.size, 3, generator=generator)
        super().__init__({"image": picture.mean((0, 1)).lerp(noise, config.noise)})
        self.network = named_vgg(config.network)
        maps = self.network.features(picture[None], config.layers)
        self.targets = gram_targets(maps)
        scaled = config.network == "vgg16"
        self.weights = None if scaled else {layer: float(v.mean()) ** -4 for layer, v in maps.items()}

    @property
    def image(self) -> torch.Tensor:
        """(N, N, 3) sRGB in [0, 1]."""
        return self.named["image"]

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """A quarter of the squared distance of the Gram matrices (equation 4)."""
        image, around = self.image, AROUND if self.config.periodic else 0
        around = min(around, self.config.size)
        if around:
            planes = pad(image.permute(2, 0, 1)[None], (around,) * 4, mode="circular")
            image = planes[0].permute(1, 2, 0)
        taps = {layer: self._tap(layer, around) for layer in self.targets}
        grams = {layer: gram[0] for layer, gram in self.network.read(image[None], taps).items()}
        return Step(gram_distance(grams, self.targets, self.weights) / 4, {}, self._clamp)

    def _tap(self, layer: str, around: int) -> GramTap:
        """Gram matrix of a layer, without the features of a border of `around` pixels."""
        operation = self.network.index_of(layer)
        if not around:
            return GramTap(operation)
        border, side = around >> halvings(layer), self.config.size >> halvings(layer)
        row = torch.arange(border, border + side)
        return GramTap(operation, [(row[:, None] * (side + 2 * border) + row).flatten()])

    @torch.no_grad()
    def _clamp(self) -> None:
        self.image.clamp_(0, 1)

    def preview(self, step: int) -> np.ndarray:
        """The exemplar, and the picture."""
        image = self.image.detach().numpy()
        return np.hstack([framed(self.exemplar, self.config.exemplar_size, len(image)), image])

    def metadata(self) -> dict[str, str]:
        return {"method": "gatys", "exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
