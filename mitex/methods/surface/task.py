"""The synthesis of a texture on a surface as a task for the loop (Kovacs et al. 2024, section 3.4)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from typing import Any

import numpy as np
import torch
from scipy.sparse import csr_array

from mitex.cache import content_key
from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.features.frozen import Tap
from mitex.features.vgg import Weights
from mitex.methods.surface.colour_space import ColourSpace
from mitex.methods.surface.comparison import Comparison, GramComparison, TransportComparison
from mitex.methods.surface.config import SurfaceConfig
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.network import SurfaceVgg
from mitex.methods.surface.palette import Palette
from mitex.methods.surface.patches import joined_patches
from mitex.methods.surface.views import Views
from mitex.methods.surface.weights import network_weights
from mitex.methods.surface.words import Words
from mitex.progress import announce
from mitex.runtime import keep_freed_memory
from mitex.sparse import csr_tensor
from mitex.training import ParameterTask, Step
from mitex.training.optim import multistep
from mitex.triples import CYCLE, channel_triples, map_layout, triple_images

VIEW = 384  # side of a preview's images [px]
CONTENT = "content"
ALL_TEXELS = 0.1  # what a step costs beside the network on the finest scale, of the network's cost, measured


class SurfaceTask(ParameterTask):
    """Texels whose features shall have the Gram matrices of the exemplar's, or which shall be what words say.

    With several maps, a step compares some channel triples in turn (see `mitex.triples`): the mixed ones
    tie the maps together.

    Attributes:
        space: what the optimizer works in.
        coordinates: (n, C) leaf, the texels with values of their own there, in the order of `levels`.

    Args:
        config: settings.
        exemplar: maps to match; None for words alone, which get an albedo.
        domain: the surface.
        content: (N, 3) sRGB in [0, 1] in the order of the texels, whose structure shall stay while the look
            becomes the exemplar's (style transfer). The synthesis starts from it.
        inputs: further metadata of inputs that a resumed run must share.
        words: what the albedo shall be, beside the exemplar and the content if there are such.
        resumed: a checkpoint brings the texels: no patches are laid before it is read.

    Raises:
        ConfigError: a content for more than the albedo, or without words on several scales; L-BFGS for
            several maps; words for maps without an albedo.
    """

    def __init__(
        self,
        config: SurfaceConfig,
        exemplar: Exemplar | None,
        domain: SurfaceDomain,
        content: np.ndarray | None = None,
        inputs: Mapping[str, str] | None = None,
        words: Words | None = None,
        resumed: bool = False,
    ) -> None:
        keep_freed_memory()
        self.config, self.exemplar, self.domain, self.levels = config, exemplar, domain, domain.levels
        self.inputs, self.views, self.words = dict(inputs or {}), Views(domain, VIEW), words
        maps = ["albedo"] if exemplar is None else sorted(exemplar.maps)
        _check_maps(config, maps, content is not None, words is not None)
        self.layout = map_layout(maps)
        self.triples = channel_triples(self.layout, True, config.seed)
        generator = torch.Generator().manual_seed(config.seed)
        self.space = self._space()
        seen = exemplar is not None or content is not None
        weights = network_weights(config, generator) if seen else None  # what is missing is missed at once
        super().__init__({"coordinates": self._start(generator, content, resumed)})
        self.coordinates = self.named["coordinates"]
        self.networks: list[SurfaceVgg] = []
        self.comparisons: list[Comparison] = []
        self.content: list[torch.Tensor] = []
        if seen:
            self.networks = [self._network(scale, weights) for scale in range(config.scales + 1)]
            if exemplar is not None:
                self.comparisons = self._comparisons(exemplar, weights)
        if content is not None:
            start = torch.from_numpy(content[self.levels.order].astype(np.float32))
            layer = config.content_layer
            self.content = [network.features(start, [layer])[layer] for network in self.networks]

    @property
    def channels(self) -> int:
        """C."""
        return sum(map(len, self.layout.values()))

    @property
    def values(self) -> torch.Tensor:
        """(n, C) the maps' channels by `layout`, in the order of `levels`, in [0, 1]."""
        return self.space.values(self.coordinates)

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """Distance of features from the exemplar's, averaged over the triples of the step, and that of views
        from the words.
        """
        scale, values = self.scale(step), self.values
        triples = self._draw_triples(step, generator)
        total, metrics = torch.zeros(()), {"scale": float(scale)}
        if self.networks:
            total = sum((self._features_cost(values, scale, k, generator) for k in triples), total)
            total = total / len(triples)
        if self.words is not None:
            albedo = self._pooled(values[:, list(self.layout["albedo"])], scale)
            terms = self.words.terms(albedo, generator)
            distance = torch.stack(list(terms.values())).sum()
            total = total + self.config.text_weight * self._unit(scale) * distance
            metrics |= {name: float(term.detach()) for name, term in terms.items()}
        return Step(total, metrics, partial(self._diffuse_and_clamp, step))

    def _features_cost(
        self, values: torch.Tensor, scale: int, k: int, generator: torch.Generator
    ) -> torch.Tensor:
        """Distance of triple `k` from the exemplar, and from the content."""
        network, colours = self.networks[scale], values[:, self.triples[k].channels]
        comparison = self.comparisons[scale] if self.comparisons else None
        taps = dict(comparison.taps(network, generator)) if comparison else {}
        if self.content:
            taps[CONTENT] = Tap(network.index_of(self.config.content_layer))
        features, cost = network.read(colours, taps), torch.zeros(())
        if self.content:
            difference = features.pop(CONTENT) - self.content[scale]
            cost = cost + self.config.content_weight * difference.square().mean()
        return cost + comparison.cost(features, colours, k, generator) if comparison else cost

    def _unit(self, scale: int) -> torch.Tensor:
        """What words are weighed by: about the cost of a surface without any features."""
        if self.comparisons:
            kinds = [triple.kind for triple in self.triples]
            return self.comparisons[scale].sizes[kinds.index("albedo")]
        if self.content:
            return self.config.content_weight * self.content[scale].square().mean()
        return torch.ones(())

    def _pooled(self, colours: torch.Tensor, scale: int) -> torch.Tensor:
        """(n, 3) the mean colours of the groups that texels are in on a scale."""
        if not scale:
            return colours
        group = torch.from_numpy(self.levels.groups(scale))
        counts = torch.bincount(group)[:, None]
        means = torch.zeros(len(counts), 3).index_add(0, group, colours) / counts
        return means[group]

    def scale(self, step: int) -> int:
        """How often the texels are pooled before they enter the network in a step."""
        coarse = round(self.config.coarse_share * self.config.steps) if self.config.scales else 0
        return 0 if step >= coarse else self.config.scales - step * self.config.scales // coarse

    def cost(self, step: int) -> float:
        """Of a step: what the network reads, a quarter for each pooling, what is done with all texels, and
        words, which cost about as much on any scale as the network on the finest.
        """
        words = 0.0 if self.config.text is None else 1.0
        return words if words and not self.networks else words + 0.25 ** self.scale(step) + ALL_TEXELS

    def _diffuse_and_clamp(self, step: int) -> None:
        """Wears down what is finer than the taps, and brings values back to [0, 1].

        As much less as the learning rate falls: else it would blur more than the last steps sharpen.
        """
        share = multistep(self.config.diffusion, self.config.milestones, self.config.decay)(step)
        with torch.no_grad():
            if share:
                self.coordinates.lerp_(self._mean_of_taps @ self.coordinates, share)
            values = self.values
            inside = values.clamp(0.0, 1.0)
            if not torch.equal(values, inside):
                self.coordinates.copy_(self.space.coordinates(inside))

    def in_texel_order(self) -> np.ndarray:
        """(N, C) values in the order of `Texels`."""
        return self.levels.spread @ self.values.detach().clamp(0, 1).numpy()

    def preview(self, step: int) -> np.ndarray:
        """For each triple but the mixtures a row: an exemplar, if any, and the mesh from two sides, unlit."""
        views = self.views.images(self.in_texel_order())
        if self.exemplar is None:
            return np.hstack(list(views))
        unmixed = [p for p in self.triples if p.kind != "mix"]
        exemplars = triple_images(self.exemplar.resized(VIEW), unmixed, self.layout)
        pairs = zip(unmixed, exemplars, strict=True)
        return np.concatenate([np.hstack([e, *views[..., list(p.channels)]]) for p, e in pairs])

    def metadata(self) -> dict[str, str]:
        known = {} if self.words is None else self.words.metadata()
        if self.exemplar is None:
            known["exemplar"] = str(self.config.text)
        else:
            known |= {"exemplar": self.exemplar.name, "exemplar_key": self.exemplar.key}
        key = content_key(self.domain.mesh.vertices, self.domain.mesh.faces, self.domain.uv)
        mesh = {"mesh": self.domain.mesh.name, "mesh_key": key}
        return {"method": "surface", "maps": ",".join(self.layout)} | known | mesh | self.inputs

    @cached_property
    def _mean_of_taps(self) -> torch.Tensor:
        """(n, n) sparse: for each element the mean over the taps of the first convolution."""
        lookup: Any = self.levels.lookup
        count, rows = lookup.shape[1], np.arange(lookup.shape[0] + 1, dtype=np.int32)
        ones = np.full(lookup.shape[0], 1 / 9, np.float32)
        mean = csr_array((ones, rows[:-1], rows[::9]), shape=(count, lookup.shape[0]))
        return csr_tensor(mean @ lookup)

    def _space(self) -> ColourSpace:
        if self.exemplar is None:
            return ColourSpace.around_grey(self.channels)
        if self.config.whitened:
            return ColourSpace.of(self.exemplar, self.layout)
        return ColourSpace.plain(self.channels)

    def _network(self, scale: int, weights: Weights | None) -> SurfaceVgg:
        config, levels = self.config, self.levels
        return SurfaceVgg(
            levels, config.pooling, "auto", config.bilinear, scale, weights, normalised=self._normalised
        )

    @property
    def _normalised(self) -> bool:
        """Moments are not scale free; Gram matrices want the published scale."""
        return self.config.loss == "transport"

    def _comparisons(self, exemplar: Exemplar, weights: Weights | None) -> list[Comparison]:
        """With the exemplar, on each scale."""
        announce("comparing the exemplar with itself on every scale")
        # The image network has the same weights: what differs is only where it looks.
        config = self.config
        network = Vgg16(config.pooling, normalised=self._normalised, weights=weights)
        comparisons = []
        for scale in range(config.scales + 1):
            size = max(self.domain.exemplar_side(config) >> scale, 16)
            images = torch.from_numpy(triple_images(exemplar.resized(size), self.triples, self.layout))
            palette = Palette(self.levels, images, scale, self._steps) if config.colours else None
            comparisons.append(_comparison(config, network, images, palette))
        return comparisons

    @property
    def _steps(self) -> torch.Tensor | None:
        """(n,) steps of the taps at the elements; None where all are 1."""
        steps = self.domain.steps
        return None if steps is None else torch.from_numpy(steps[self.levels.order].astype(np.float32))

    def _start(self, generator: torch.Generator, content: np.ndarray | None, resumed: bool) -> torch.Tensor:
        """The coordinates before the first step, of a content (N, 3) or of what the settings say."""
        order = self.levels.order
        if content is not None:
            return self.space.coordinates(torch.from_numpy(content[order].astype(np.float32)))
        if self.exemplar is not None and self.config.start == "patches":
            if resumed:
                return torch.zeros(len(order), self.channels)
            patches = joined_patches(self.exemplar, self.layout, self.domain, self.config)
            return self.space.coordinates(torch.from_numpy(patches[order]))
        noise = torch.rand(len(self.levels.order), self.channels, generator=generator)
        centred = self.config.whitened or self.exemplar is None
        noise = self.config.noise * (noise - 0.5 if centred else noise)
        return self.space.coordinates(self.space.values(noise).clamp(0, 1))

    def _draw_triples(self, step: int, generator: torch.Generator) -> list[int]:
        """The triples of a step: kinds in turn, any of a kind."""
        kinds = [kind for kind in CYCLE if any(p.kind == kind for p in self.triples)]
        count = min(self.config.triples, len(kinds))
        return [self._draw(kinds[(step * count + k) % len(kinds)], generator) for k in range(count)]

    def _draw(self, kind: str, generator: torch.Generator) -> int:
        of_kind = [k for k, p in enumerate(self.triples) if p.kind == kind]
        return of_kind[int(torch.randint(len(of_kind), (), generator=generator))]


def _check_maps(config: SurfaceConfig, maps: list[str], content: bool, words: bool) -> None:
    """Refuses maps that cannot be synthesized in this way."""
    if content and (maps != ["albedo"] or config.scales and not words):
        raise ConfigError(
            "style transfer takes one image and one scale", "give an image as `exemplar`, and set scales=0"
        )
    if config.optimizer == "lbfgs" and len(maps) > 1:
        raise ConfigError("lbfgs takes one map", "give an image as `exemplar`, or set optimizer=adam")
    if words and "albedo" not in maps:
        raise ConfigError("the exemplar has no albedo, which words are about", "give an image as `exemplar`")


def _comparison(
    config: SurfaceConfig, network: Vgg16, images: torch.Tensor, palette: Palette | None
) -> Comparison:
    if config.loss == "gram":
        region = round((config.region * images.shape[1]) ** 2) or None
        return GramComparison(network, images, config.compared, region, palette, config.colours)
    return TransportComparison(network, images, config.compared, config.samples, config.moment_weight)
