"""What a state shows: the channels of each map, and the exemplar's features to compare with."""

from __future__ import annotations

import numpy as np
import torch
import torch.nn.functional as F

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.triples import ChannelTriple, Layout, triple_images

MOST = 1 << 15  # feature vectors kept of a picture and layer


class Targets:
    """The features of the exemplar's pictures, computed once and read at random places.

    Args:
        exemplar: maps at the size at which the features see them.
        pictures: the channel triples that the network looks at.
        layout: channels of the maps in the pictures.
        network: frozen features.
        layers: of the network.
    """

    def __init__(
        self,
        exemplar: Exemplar,
        pictures: list[ChannelTriple],
        layout: Layout,
        network: Vgg16,
        layers: tuple[str, ...],
    ) -> None:
        self.pictures, self._network, self._size = pictures, network, exemplar.size
        images = torch.from_numpy(triple_images(exemplar, pictures, layout)).to(network.device)
        generator = torch.Generator().manual_seed(0)
        self._vectors = {"colour": _some(images.flatten(1, 2), generator)}
        parts: dict[str, list[torch.Tensor]] = {layer: [] for layer in layers}
        with torch.no_grad():
            for image in images:
                for layer, features in network.features(image[None], layers).items():
                    parts[layer].append(_some(features.flatten(1, 2).to(network.dtype), generator))
        self._vectors |= {layer: torch.cat(vectors) for layer, vectors in parts.items()}

    def size(self, layer: str) -> int:
        """Number of feature vectors of a picture in a layer ("colour": its pixels)."""
        return self._vectors[layer].shape[1]

    def maps(self, layer: str, which: torch.Tensor) -> torch.Tensor:
        """Whole feature maps (K, h, w, C) float32 of pictures, of a layer small enough to be kept whole."""
        return self._vectors[layer][which].float().unflatten(1, self._network.extent(layer, *self._size))

    def sample(self, layer: str, which: torch.Tensor, positions: torch.Tensor) -> torch.Tensor:
        """Vectors (K, n, C) float32 of pictures `which` (K,) at `positions` (K, n)."""
        return self._vectors[layer][which[:, None].to(positions.device), positions].float()


def _some(vectors: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """At most `MOST` of the vectors (P, n, C), at random places: large exemplars would fill the memory."""
    count = vectors.shape[1]
    if count <= MOST:
        return vectors
    return vectors[:, torch.randperm(count, generator=generator)[:MOST].to(vectors.device)]


def enlarged(exemplar: Exemplar, size: int) -> Exemplar:
    """The exemplar bilinearly enlarged to `size` [px] (low-pass; a no-op at its own size)."""
    if exemplar.size == (size, size):
        return exemplar

    def one(array: np.ndarray) -> np.ndarray:
        image = torch.from_numpy(np.ascontiguousarray(array)).permute(2, 0, 1)[None]
        return F.interpolate(image, size=(size, size), mode="bilinear")[0].permute(1, 2, 0).numpy()

    return Exemplar({name: one(array) for name, array in exemplar.maps.items()}, exemplar.name)
