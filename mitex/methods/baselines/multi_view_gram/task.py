"""The synthesis of a texture through views, as a task for the loop (Mordvintsev et al. 2018)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

import numpy as np
import torch

from mitex.cache import content_key
from mitex.exemplar import Exemplar
from mitex.features.coverage import covered_places
from mitex.features.frozen import GramTap, Tap
from mitex.features.layers import CHANNELS
from mitex.features.vgg19 import named_vgg
from mitex.losses.gram import gram_targets
from mitex.mesh import Mesh
from mitex.methods.baselines.multi_view_gram.config import MultiViewConfig
from mitex.methods.baselines.multi_view_gram.gram_average import GramAverage
from mitex.methods.baselines.multi_view_gram.spectrum import image_of, random_spectrum
from mitex.methods.exemplar_pictures import albedo, framed, side_in_view
from mitex.methods.layout import exemplar_texels
from mitex.methods.texture_views import TextureViews, boxed, random_view
from mitex.runtime import keep_freed_memory
from mitex.scenes.cameras import Cameras, orbit
from mitex.texels import Texels
from mitex.training import ParameterTask, Step

CONTENT = "content"  # name of what is read for it


class MultiViewTask(ParameterTask):
    """A texture whose views shall have the Gram matrices of the exemplar.

    The authors take Inception V1, here VGG-16 stands in its place, whose weights come with Mitex; the paper
    that compares with this method (Kovacs et al. 2024) took VGG-19. Layers of the latter are divided by their
    means on the exemplar, so that they count as those of the normalised VGG-16 do.

    Args:
        config: settings.
        exemplar: whose albedo is matched.
        mesh: with the UVs of the texture.
        content: (R, R, 3) texture in sRGB whose views shall keep their structure (style transfer).
    """

    def __init__(
        self, config: MultiViewConfig, exemplar: Exemplar, mesh: Mesh, content: np.ndarray | None = None
    ) -> None:
        keep_freed_memory()
        self.config, self.exemplar, self.mesh = config, exemplar, mesh
        generator = torch.Generator().manual_seed(config.seed)
        super().__init__({"spectrum": random_spectrum(config.resolution, generator)})
        box = boxed(mesh)
        assert box.uv is not None
        self.texels = Texels.rasterize(box, box.uv, config.resolution)
        charts = self.texels.image(self.texels.chart[self.texels.face][:, None], -1)[..., 0]
        self.cameras = partial(random_view, fov=config.fov, side=config.view)
        self.views = TextureViews(
            box, charts, self.cameras(generator, config.nearest, config.farthest), config.antialias
        )
        self.network = named_vgg(config.network)
        self.means = self._means()
        self.average = GramAverage({layer: CHANNELS[layer] for layer in config.layers}, config.memory)
        self.targets = self._targets()
        self.content = None if content is None else torch.from_numpy(content.astype(np.float32))

    @property
    def texture(self) -> torch.Tensor:
        """(R, R, 3) sRGB in (0, 1), row 0 on top."""
        return image_of(self.named["spectrum"])

    @property
    def exemplar_side(self) -> int:
        """Of the exemplar, so that a texel of it is as large as one on the mesh at the mean distance [px]."""
        config = self.config
        height = (config.nearest + config.farthest) * math.tan(0.5 * math.radians(config.fov))
        width = exemplar_texels(config.exemplar_size, config.resolution)
        return side_in_view(width * self.texels.size, config.view, height)

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Mean absolute differences of averaged Gram matrices, and of the content's features if any."""
        camera = self.cameras(generator, self.config.nearest, self.config.farthest)
        picture, coverage = self.views.picture(self.texture, camera)
        taps: dict[str, Tap | GramTap] = {n: self._gram_tap(n, coverage) for n in self.config.layers}
        if self.content is not None:
            taps[CONTENT] = self._content_tap
        values = self.network.read(picture[None], taps)
        grams = {layer: values[layer][0] for layer in self.config.layers}
        blended = self.average.blended(grams)
        total = torch.zeros(())
        for layer, target in self.targets.items():
            total = total + (blended[layer] - target).abs().mean() / self.means[layer] ** 2
        if self.content is not None:
            total = total + self.config.content_weight * self._content_loss(values[CONTENT], camera)
        kept = {layer: gram.detach() for layer, gram in grams.items()}
        return Step(total, {}, partial(self.average.add, kept))

    def state(self) -> dict[str, torch.Tensor]:
        return super().state() | self.average.state()

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        super().load_state(state)
        self.average.load_state(state)

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """The exemplar as large as it shall look on the mesh, and the mesh from two sides, unlit."""
        config, pictures = self.config, []
        distance = 0.5 * (config.nearest + config.farthest)
        for start in (0, 180):
            camera = orbit(1, distance=distance, fov=config.fov, resolution=config.view, start=start)
            pictures.append(self.views.picture(self.texture.detach(), camera)[0].numpy())
        return np.hstack([framed(self.exemplar, self.exemplar_side, config.view), *pictures])

    def metadata(self) -> dict[str, str]:
        exemplar = {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        key = content_key(self.mesh.vertices, self.mesh.faces, self.mesh.uv)
        content = None if self.content is None else self.content.numpy()
        inputs = {"mesh": self.mesh.name, "mesh_key": key, "content_key": content_key(content)}
        return {"method": "multi_view_gram"} | exemplar | inputs

    def _targets(self) -> Mapping[str, torch.Tensor]:
        """Layer -> (C, C) Gram matrix of the exemplar."""
        picture = albedo(self.exemplar, self.exemplar_side)
        return gram_targets(self.network.features(picture[None], self.config.layers))

    def _means(self) -> Mapping[str, float]:
        """Layer -> mean activation on the exemplar; 1 where layers have been normalised."""
        names = {*self.config.layers, self.config.content_layer}
        if self.config.network == "vgg16":
            return dict.fromkeys(names, 1.0)
        picture = albedo(self.exemplar, self.exemplar_side)
        return {
            name: float(value.mean()) for name, value in self.network.features(picture[None], names).items()
        }

    def _gram_tap(self, layer: str, coverage: torch.Tensor) -> GramTap:
        size = self.network.extent(layer, *coverage.shape)
        regions = [covered_places(coverage, size)] if self.config.masked else None
        return GramTap(self.network.index_of(layer), regions)

    @property
    def _content_tap(self) -> Tap:
        return Tap(self.network.index_of(self.config.content_layer))

    def _content_loss(self, features: torch.Tensor, camera: Cameras) -> torch.Tensor:
        """How far the features (1, C, h, w) of a picture are from those of the content, seen likewise."""
        assert self.content is not None
        with torch.no_grad():
            original = self.views.picture(self.content, camera)[0]
            expected = self.network.read(original[None], {CONTENT: self._content_tap})[CONTENT]
        return (features - expected).abs().mean() / self.means[self.config.content_layer]
