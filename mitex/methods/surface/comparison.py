"""How the features of a texture are compared with the exemplar's: Gram matrices, or relaxed transport."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import torch

from mitex.features import Vgg16, normalise_colours
from mitex.features.frozen import GramTap, Tap
from mitex.losses import gram_distance, gram_matrix, moment_distance, relaxed_transport
from mitex.methods.surface.network import SurfaceVgg
from mitex.methods.surface.palette import Palette
from mitex.methods.surface.statistics import exemplar_features

MIN_VECTORS = 256  # feature vectors of a region


class Comparison(Protocol):
    """What a loss reads of the network, and what it makes of that."""

    @property
    def sizes(self) -> list[torch.Tensor]:
        """About what a surface without any features costs, of each triple."""
        ...

    def taps(self, network: SurfaceVgg, generator: torch.Generator) -> Mapping[str, Tap | GramTap]:
        """What `cost` needs of the network: layer -> tap."""
        ...

    def cost(
        self, features: Mapping[str, torch.Tensor], colours: torch.Tensor, k: int, generator: torch.Generator
    ) -> torch.Tensor:
        """How far the texels are from the exemplar, as one triple of channels shows both.

        Args:
            features: layer -> what its tap read.
            colours: (N, 3) the texels' channels of the triple.
            k: number of the triple.
            generator: source of all randomness.

        Returns:
            Scalar.
        """
        ...


class GramComparison:
    """Squared distance of Gram matrices, averaged over layers (section 3.4) and regions of the surface.

    One matrix for the whole surface says nothing of where its features are: a texture may be strong in one
    place and faint elsewhere. Regions are compact in space (`regions.bisect`).

    Args:
        network: of images.
        images: (P, H, W, 3) the exemplar's channel triples.
        layers: that are compared.
        region: texels of a region at the images' scale; None compares the whole surface, as the paper does.
            Regions of deep layers are larger where that is needed for `MIN_VECTORS` feature vectors in each.
        palette: the distribution of colours that is compared as well, if any.
        weight: of that, beside Gram matrices: 1 where colours that are all alike cost as much as no features.
    """

    def __init__(
        self,
        network: Vgg16,
        images: torch.Tensor,
        layers: tuple[str, ...],
        region: int | None = None,
        palette: Palette | None = None,
        weight: float = 0.0,
    ) -> None:
        self.layers, self.region, self.palette, self.weight = layers, region, palette, weight
        self.targets = []
        for image in images:
            features = exemplar_features(network, image, layers)
            self.targets.append({layer: gram_matrix(f) for layer, f in features.items()})
        self.sizes = [
            torch.stack([g.square().mean() for g in grams.values()]).sum() / len(layers)
            for grams in self.targets
        ]

    def taps(self, network: SurfaceVgg, generator: torch.Generator) -> dict[str, GramTap]:
        return {
            layer: GramTap(network.index_of(layer), self._regions(network, layer)) for layer in self.layers
        }

    def _regions(self, network: SurfaceVgg, layer: str) -> list[torch.Tensor] | None:
        if self.region is None:
            return None
        most = network.counts[layer] // MIN_VECTORS
        count = min(network.counts["relu1_1"] // self.region, most)
        return network.regions(layer, count) if count > 1 else None

    def cost(
        self, features: Mapping[str, torch.Tensor], colours: torch.Tensor, k: int, generator: torch.Generator
    ) -> torch.Tensor:
        cost = gram_distance(features, self.targets[k]) / len(self.layers)
        if self.palette is None:
            return cost
        return cost + self.weight * self.sizes[k] * self.palette.distance(colours, k)


class TransportComparison:
    """Relaxed optimal transport and moments at random places (MeshNCA, equations 4 to 6), and of colours.

    Args:
        network: of images, with layers of equal scale, as the moments are not scale free.
        images: (P, H, W, 3) the exemplar's channel triples.
        layers: that are compared.
        samples: feature vectors of each layer in a step.
        moment_weight: of the moments.
    """

    def __init__(
        self,
        network: Vgg16,
        images: torch.Tensor,
        layers: tuple[str, ...],
        samples: int,
        moment_weight: float,
    ) -> None:
        self.layers, self.samples, self.moment_weight = layers, samples, moment_weight
        self.low_precision = network.dtype == torch.bfloat16
        self.colours = [normalise_colours(image.flatten(0, 1)) for image in images]
        self.targets = [exemplar_features(network, image, layers) for image in images]
        self.sizes = [torch.tensor(float(len(layers)))] * len(images)  # cosine distances, 1 at right angles

    def taps(self, network: SurfaceVgg, generator: torch.Generator) -> dict[str, Tap]:
        return {
            layer: Tap(network.index_of(layer), self._places(network.counts[layer], generator)[None])
            for layer in self.layers
        }

    def cost(
        self, features: Mapping[str, torch.Tensor], colours: torch.Tensor, k: int, generator: torch.Generator
    ) -> torch.Tensor:
        ours, theirs = (c[self._places(len(c), generator)][None] for c in (colours, self.colours[k]))
        total = relaxed_transport(normalise_colours(ours), theirs, euclidean=True).sum()
        for layer, a in features.items():
            target = self.targets[k][layer]
            b = target[self._places(len(target), generator)][None]
            total = total + relaxed_transport(a, b, low_precision=self.low_precision).sum()
            total = total + self.moment_weight * moment_distance(a, b, self.low_precision).sum()
        return total

    def _places(self, count: int, generator: torch.Generator) -> torch.Tensor:
        return torch.randint(count, (min(count, self.samples),), generator=generator)
