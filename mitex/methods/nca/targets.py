"""What a state shows: the channels of each map, and the exemplar's features to compare with."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import torch
import torch.nn.functional as F

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.triples import ChannelTriple, triple_images

# Channels of the state, as in the authors' PBR checkpoints; 3 to 5 are hidden.
STATE_CHANNELS: dict[str, tuple[int, ...]] = {
    "albedo": (0, 1, 2),
    "height": (6,),
    "normal": (7, 8, 9),
    "roughness": (10,),
    "ambient_occlusion": (11,),
}
OFFSET = 0.5  # value = state + OFFSET


def state_maps(state: np.ndarray, maps: list[str]) -> dict[str, np.ndarray]:
    """The maps that a state (V, C) shows: name -> (V, c), clipped to [0, 1]; the albedo is sRGB."""
    return {name: np.clip(state[:, STATE_CHANNELS[name]] + OFFSET, 0, 1) for name in maps}


def state_layout(maps: Iterable[str]) -> dict[str, tuple[int, ...]]:
    """Where a state shows the maps: name -> channels."""
    return {name: STATE_CHANNELS[name] for name in maps}


class Targets:
    """The features of the exemplar's pictures, computed once and read at random places.

    Args:
        exemplar: maps at the size at which the features see them.
        pictures: the channel triples that the network looks at.
        network: frozen features.
        layers: of the network.

    Attributes:
        images: (P, H, W, 3) float32 in [0, 1], the pictures.
    """

    def __init__(
        self, exemplar: Exemplar, pictures: list[ChannelTriple], network: Vgg16, layers: tuple[str, ...]
    ) -> None:
        self.pictures = pictures
        images = triple_images(exemplar, pictures, STATE_CHANNELS)
        self.images = torch.from_numpy(images).to(network.device)
        self._vectors = {"colour": self.images.flatten(1, 2)}
        with torch.no_grad():
            for one in layers:
                maps = [network.features(image[None], [one])[one] for image in self.images]
                self._vectors[one] = torch.cat(maps).flatten(1, 2).to(network.dtype)

    def size(self, layer: str) -> int:
        """Number of feature vectors of a picture in a layer ("colour": its pixels)."""
        return self._vectors[layer].shape[1]

    def sample(self, layer: str, which: torch.Tensor, positions: torch.Tensor) -> torch.Tensor:
        """Vectors (K, n, C) float32 of pictures `which` (K,) at `positions` (K, n)."""
        return self._vectors[layer][which[:, None], positions].float()


def enlarged(exemplar: Exemplar, size: int) -> Exemplar:
    """The exemplar bilinearly enlarged to `size` [px] (low-pass; a no-op at its own size)."""
    if exemplar.size == (size, size):
        return exemplar

    def one(array: np.ndarray) -> np.ndarray:
        image = torch.from_numpy(np.ascontiguousarray(array)).permute(2, 0, 1)[None]
        return F.interpolate(image, size=(size, size), mode="bilinear")[0].permute(1, 2, 0).numpy()

    return Exemplar({name: one(array) for name, array in exemplar.maps.items()}, exemplar.name)
