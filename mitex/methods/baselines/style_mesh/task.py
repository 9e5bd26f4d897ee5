"""The synthesis of a texture through views of several heights, as a task (Hoellein et al. 2022)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import torch

from mitex.cache import content_key
from mitex.exemplar import Exemplar
from mitex.features.frozen import GramTap
from mitex.features.vgg19 import named_vgg
from mitex.losses.gram import gram_distance, gram_targets
from mitex.mesh import Mesh
from mitex.methods.baselines.style_mesh.config import LEAST_SIDE, StyleMeshConfig
from mitex.methods.baselines.style_mesh.layered import (
    fine_energy,
    keep_in_range,
    sum_of,
    within_range,
    zero_textures,
)
from mitex.methods.baselines.style_mesh.visible import Counting, Visible, cameras_around, places_in, shares
from mitex.methods.exemplar_pictures import albedo, framed
from mitex.methods.layout import exemplar_texels
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
    large the exemplar is, where cameras stand, and how many there are, is ours.

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
        self.exemplar_side = exemplar_texels(config.exemplar_size, config.resolution, LEAST_SIDE)
        self.targets = self._grams(self.exemplar_side, config.layers)
        small_layers = config.small_layers if config.by_angle else ()
        self.small_targets = self._grams(self.exemplar_side // 2, small_layers)

    @property
    def texture(self) -> torch.Tensor:
        """(R, R, 3) sRGB in [0, 1], row 0 on top."""
        return sum_of(self.parameters).clamp(0, 1)

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Gram matrices of one view at all its heights, and what holds the finer textures near zero.

        Each height's distance is weighted by its share of all pixels that count.
        """
        view = int(torch.randint(self.config.views, (), generator=generator))
        texture, total = self._shown(), torch.zeros(())
        counting = [self._counting(view, k) for k in range(len(self.heights))]
        whole = sum(pixels.share.mean() for pixels in counting)
        for k, pixels in enumerate(counting):
            if pixels.share.mean() > LEAST:
                distance = self._picture_loss(texture, view, k, pixels)
                total = total + float(pixels.share.mean() / whole) * distance
        energy = fine_energy(self.parameters)
        terms = {"gram": total.item(), "fine": energy.item()}
        commit = partial(keep_in_range, self.parameters)
        return Step(total + self.config.coarse_first * energy, terms, commit)

    @torch.no_grad()
    def preview(self, step: int) -> np.ndarray:
        """The exemplar, and the mesh from two sides, unlit."""
        side = self.config.view
        beside = framed(self.exemplar, min(self.exemplar_side, side), side)
        texture, middle = self.texture, self.config.views // 2
        views = {middle, min(middle + 1, self.config.views - 1)}
        pictures = [self.pictures[0].picture(texture, self._camera(k, 0))[0].numpy() for k in sorted(views)]
        return np.hstack([beside, *pictures])

    def metadata(self) -> dict[str, str]:
        exemplar = {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        key = content_key(self.mesh.vertices, self.mesh.faces, self.mesh.uv)
        return {"method": "style_mesh", "mesh": self.mesh.name, "mesh_key": key} | exemplar

    def _shown(self) -> torch.Tensor:
        """(R, R, 3) the texture that views show, sRGB; in [0, 1] if it is `clamped`."""
        texture = sum_of(self.parameters)
        return within_range(texture) if self.config.clamped else texture

    def _picture_loss(self, texture: torch.Tensor, view: int, k: int, pixels: Counting) -> torch.Tensor:
        """Of the picture of one height, in which pixels count; their gradients are weighted by how much.

        What is seen frontally and what is seen at a slant have Gram matrices of their own, and only the
        former are compared with the smaller exemplar's, too.
        """
        window = pixels.window()
        pixels = pixels.within(window)
        picture = self.pictures[k].picture(texture, self._camera(view, k))[0][window]
        if picture.requires_grad:
            picture.register_hook(lambda gradient: gradient * pixels.weight[..., None])
        taps, wanted = {}, {}
        for layer in self.config.layers:
            targets = [self.targets[layer]]
            if layer in self.small_targets:
                targets.append(self.small_targets[layer])
            size = self.network.extent(layer, *picture.shape[:2])
            areas = [
                (places_in(area, size), targets[:n]) for area, n in zip(pixels.areas, (2, 1), strict=False)
            ]
            areas = [(places, theirs) for places, theirs in areas if len(places)]
            if areas:
                taps[layer] = GramTap(self.network.index_of(layer), [places for places, _ in areas])
                wanted[layer] = [theirs for _, theirs in areas]
        total = torch.zeros(())
        for layer, grams in self.network.read(picture[None], taps).items():
            for gram, theirs in zip(grams, wanted[layer], strict=True):
                for target in theirs:
                    total = total + gram_distance({layer: gram}, {layer: target}, self.weights)
        return total

    def _counting(self, view: int, k: int) -> Counting:
        """What the pixels of a view count for in the picture of one height."""
        visible = Visible.of(self.stage, self.box, self._camera(view, k))
        share = (visible.cosine > 0).astype(np.float32)
        if self.config.by_depth:
            wanted = visible.height(self.config.fov, self.texels.size)
            share *= shares(wanted, self.heights, k).astype(np.float32)
        return Counting.of(visible, share, self.config.frontal if self.config.by_angle else None)

    def _camera(self, view: int, k: int) -> Cameras:
        """One view, at one height."""
        places = {n: getattr(self.cameras, n)[view : view + 1] for n in ("origin", "target", "up")}
        return replace(self.cameras, **places, width=self.heights[k], height=self.heights[k])

    def _grams(self, side: int, layers: tuple[str, ...]) -> Mapping[str, torch.Tensor]:
        """Layer -> (C, C) Gram matrix of the exemplar."""
        picture = albedo(self.exemplar, side)
        return gram_targets(self.network.features(picture[None], layers) if layers else {})
