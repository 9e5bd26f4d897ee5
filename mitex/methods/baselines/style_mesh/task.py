"""The synthesis of a texture through views of several heights, as a task (Hoellein et al. 2022)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import torch

from mitex.cache import content_key
from mitex.exemplar import Exemplar
from mitex.features.coverage import covered_places
from mitex.features.frozen import GramTap
from mitex.features.vgg19 import named_vgg
from mitex.losses.gram import gram_distance, gram_targets
from mitex.mesh import Mesh
from mitex.methods.baselines.style_mesh.config import StyleMeshConfig
from mitex.methods.baselines.style_mesh.layered import fine_energy, sum_of, zero_textures
from mitex.methods.baselines.style_mesh.visible import Visible, cameras_around, shares
from mitex.methods.exemplar_pictures import albedo, framed
from mitex.methods.texture_views import TextureViews, boxed
from mitex.runtime import keep_freed_memory
from mitex.scenes.cameras import Cameras
from mitex.scenes.stage import Stage
from mitex.texels import Texels
from mitex.training import ParameterTask, Step

LEAST = 1e-3  # share of a picture's pixels that must count for it to be compared


class StyleMeshTask(ParameterTask):
    """Textures whose sum looks like the exemplar in all views, as large everywhere.

    For objects: there are no photos whose content should be kept. The authors take VGG-19, for which VGG-16
    stands in, whose weights come with Mitex.

    What differs from the publication in the preset `paper`, too: the second, smaller picture of the style is
    half as wide as the exemplar, not 256 pixels; the height of the picture in which a pixel counts is that at
    which it is as large as a texel; views are drawn with replacement, not each once an epoch. Gram matrices
    are compared at five layers, `relu1_1` to `relu5_1`, those of the smaller picture at the last two. How
    large the exemplar is, and where cameras stand, is ours.

    Args:
        config: settings.
        exemplar: whose albedo is matched.
        mesh: with the UVs of the texture.
    """

    def __init__(self, config: StyleMeshConfig, exemplar: Exemplar, mesh: Mesh) -> None:
        keep_freed_memory()
        self.config, self.exemplar, self.mesh = config, exemplar, mesh
        super().__init__(zero_textures(config.resolution, config.textures))
        self.box = boxed(mesh)
        assert self.box.uv is not None
        self.texels = Texels.rasterize(self.box, self.box.uv, config.resolution)
        charts = self.texels.image(self.texels.chart[self.texels.face][:, None], -1)[..., 0]
        self.heights = [config.view << k for k in range(config.heights)]
        self.cameras = cameras_around(config.views, config.distance, config.fov, config.view)
        self.stage = Stage(self.box)
        self.pictures = [
            TextureViews(self.box, charts, self._camera(0, k), config.antialias)
            for k in range(config.heights)
        ]
        self.network = named_vgg(config.network, "max", normalised=False)
        self.weights = dict(zip(config.layers, config.weights, strict=True))
        self.targets = self._grams(config.exemplar_size, config.layers)
        self.small_targets = self._grams(config.exemplar_size // 2, config.small_layers)

    @property
    def texture(self) -> torch.Tensor:
        """(R, R, 3) sRGB in [0, 1], row 0 on top."""
        return sum_of(self.parameters)

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Gram matrices of one view at all its heights, and what holds the finer textures near zero."""
        view = int(torch.randint(self.config.views, (), generator=generator))
        texture, total = self.texture, torch.zeros(())
        for k in range(len(self.heights)):
            total = total + self._picture_loss(texture, view, k)
        energy = fine_energy(self.parameters)
        terms = {"gram": total.item(), "fine": energy.item()}
        return Step(total + self.config.coarse_first * energy, terms)

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """The exemplar, and the mesh from two sides, unlit."""
        side = self.config.view
        beside = framed(self.exemplar, min(self.config.exemplar_size, side), side)
        texture, middle = self.texture, self.config.views // 2
        views = {middle, min(middle + 1, self.config.views - 1)}
        pictures = [self.pictures[0].picture(texture, self._camera(k, 0))[0].numpy() for k in sorted(views)]
        return np.hstack([beside, *pictures])

    def metadata(self) -> dict[str, str]:
        exemplar = {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        key = content_key(self.mesh.vertices, self.mesh.faces, self.mesh.uv)
        return {"method": "style_mesh", "mesh": self.mesh.name, "mesh_key": key} | exemplar

    def _picture_loss(self, texture: torch.Tensor, view: int, k: int) -> torch.Tensor:
        """Of the picture of one height; its gradients are weighted by what its pixels count for."""
        camera = self._camera(view, k)
        visible = Visible.of(self.stage, self.box, camera)
        weight = self._weight(visible, k)
        if weight.mean() < LEAST:
            return torch.zeros(())
        picture, coverage = self.pictures[k].picture(texture, camera)
        if picture.requires_grad:
            picture.register_hook(lambda gradient: gradient * weight[..., None])
        frontal = coverage * torch.from_numpy(visible.cosine > self._frontal).float()
        small = self.small_targets if self.config.by_angle and frontal.mean() > LEAST else {}
        masks = {layer: [coverage, frontal][: 1 + (layer in small)] for layer in self.config.layers}
        grams = self._masked_grams(picture, masks)
        total = gram_distance({layer: gram[0] for layer, gram in grams.items()}, self.targets, self.weights)
        if small:
            total = total + gram_distance({layer: grams[layer][1] for layer in small}, small, self.weights)
        return total

    def _masked_grams(
        self, picture: torch.Tensor, masks: Mapping[str, list[torch.Tensor]]
    ) -> dict[str, torch.Tensor]:
        """For each layer the Gram matrices of a picture (H, W, 3) within its masks (H, W)."""
        taps = {}
        for layer, regions in masks.items():
            size = self.network.extent(layer, *picture.shape[:2])
            taps[layer] = GramTap(
                self.network.index_of(layer), [covered_places(mask, size) for mask in regions]
            )
        return self.network.read(picture[None], taps)

    def _weight(self, visible: Visible, k: int) -> torch.Tensor:
        """(H, W) what pixels count for."""
        weight = (visible.cosine > 0).astype(np.float32)
        if self.config.by_depth:
            wanted = visible.height(self.config.fov, self.texels.size)
            weight *= shares(wanted, self.heights, k).astype(np.float32)
        if self.config.by_angle:
            weight *= visible.cosine.astype(np.float32)
        return torch.from_numpy(weight)

    @property
    def _frontal(self) -> float:
        return math.cos(math.radians(self.config.frontal))

    def _camera(self, view: int, k: int) -> Cameras:
        """One view, at one height."""
        places = {n: getattr(self.cameras, n)[view : view + 1] for n in ("origin", "target", "up")}
        return replace(self.cameras, **places, width=self.heights[k], height=self.heights[k])

    def _grams(self, side: int, layers: tuple[str, ...]) -> Mapping[str, torch.Tensor]:
        """Layer -> (C, C) Gram matrix of the exemplar."""
        picture = albedo(self.exemplar, side)
        return gram_targets(self.network.features(picture[None], layers) if layers else {})
