"""What a state shows: the channels of each map, and the pictures of them that the features compare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F

from mitex.exemplar import MAPS, Exemplar
from mitex.features import Vgg16

# Channels of the state, as in the authors' PBR checkpoints; 3 to 5 are hidden.
STATE_CHANNELS: dict[str, tuple[int, ...]] = {
    "albedo": (0, 1, 2),
    "height": (6,),
    "normal": (7, 8, 9),
    "roughness": (10,),
    "ambient_occlusion": (11,),
}
OFFSET = 0.5  # value = state + OFFSET
MIXES = 12
# With `blend`, view k shows the picture of kind CYCLE[k]; kinds that the exemplar lacks are skipped.
CYCLE = ("albedo", "normal", "grey", "mix")


def state_maps(state: np.ndarray, maps: list[str]) -> dict[str, np.ndarray]:
    """The maps that a state (V, C) shows: name -> (V, c), clipped to [0, 1]; the albedo is sRGB."""
    return {name: np.clip(state[:, STATE_CHANNELS[name]] + OFFSET, 0, 1) for name in maps}


@dataclass(frozen=True)
class Picture:
    """Three channels looked at as if they were RGB: `channels` of the state; `kind` says why."""

    kind: str
    channels: tuple[int, ...]


def pictures_of(maps: list[str], blend: bool, seed: int) -> list[Picture]:
    """The pictures for a set of maps (see `NcaConfig.blend`)."""
    colours = [Picture(name, STATE_CHANNELS[name]) for name in maps if MAPS[name] == 3]
    grey = [STATE_CHANNELS[name][0] for name in maps if MAPS[name] == 1]
    if not blend:
        order = {p.kind: p for p in colours}
        single = {name: Picture(name, STATE_CHANNELS[name] * 3) for name in maps if MAPS[name] == 1}
        return [(order | single)[name] for name in sorted(maps)]
    pictures = colours
    if grey:
        pictures = [*pictures, Picture("grey", tuple((grey * 3)[:3]))]
    return pictures + (_mixes(maps, seed) if len(maps) > 1 else [])


def _mixes(maps: list[str], seed: int) -> list[Picture]:
    """Random triples of channels out of as many different maps as there are."""
    rng = np.random.default_rng(seed)
    mixes = []
    for _ in range(MIXES):
        names = list(rng.permutation(sorted(maps)))
        chosen = [(names * 3)[k] for k in range(3)]
        mixes.append(Picture("mix", tuple(int(rng.choice(STATE_CHANNELS[name])) for name in chosen)))
    return mixes


class Targets:
    """Features of the exemplar's pictures, kept, and read at random places.

    Args:
        exemplar: maps at the size at which the features see them.
        pictures: what the features look at.
        network: frozen features.
        layers: of the network.
    """

    def __init__(
        self, exemplar: Exemplar, pictures: list[Picture], network: Vgg16, layers: tuple[str, ...]
    ) -> None:
        self.pictures = pictures
        values = {c: m for name, array in exemplar.maps.items() for c, m in _channels(name, array)}
        images = np.stack([np.stack([values[c] for c in p.channels], -1) for p in pictures])
        self.images = torch.from_numpy(np.ascontiguousarray(images, np.float32)).to(network.device)
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


def _channels(name: str, array: np.ndarray):
    return ((channel, array[..., k]) for k, channel in enumerate(STATE_CHANNELS[name]))


def enlarged(exemplar: Exemplar, size: int) -> Exemplar:
    """The exemplar bilinearly enlarged to `size` [px] (low-pass; a no-op at its own size)."""
    if exemplar.size == (size, size):
        return exemplar

    def one(array: np.ndarray) -> np.ndarray:
        image = torch.from_numpy(np.ascontiguousarray(array)).permute(2, 0, 1)[None]
        return F.interpolate(image, size=(size, size), mode="bilinear")[0].permute(1, 2, 0).numpy()

    return Exemplar({name: one(array) for name, array in exemplar.maps.items()}, exemplar.name)
