"""Channel triples: three channels of the maps, given to an image network as if they were RGB.

Image features take three channels at once. A triple that mixes channels of different maps has the features of
the exemplar only if those maps are in register, which ties them together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mitex.exemplar import MAPS, Exemplar

MIXES = 12
# The kinds of blended triples; those that the maps do not give are left out.
CYCLE = ("albedo", "normal", "grey", "mix")

Layout = Mapping[str, tuple[int, ...]]  # name of a map -> its channels in a field


def map_layout(maps: Iterable[str]) -> Layout:
    """The layout of a field whose channels are those of the maps, one map after another."""
    layout, first = {}, 0
    for name in maps:
        layout[name] = tuple(range(first, first + MAPS[name]))
        first += MAPS[name]
    return layout


@dataclass(frozen=True)
class ChannelTriple:
    """Three channels of a field, taken as RGB.

    Attributes:
        kind: the map that they are, or "grey" or "mix", see `channel_triples`.
        channels: three numbers of channels; one may come twice.
    """

    kind: str
    channels: tuple[int, ...]


def channel_triples(layout: Layout, blend: bool, seed: int) -> list[ChannelTriple]:
    """The channel triples of a set of maps.

    Args:
        layout: the maps.
        blend: False gives every map by itself; True gives the coloured ones, the grey ones packed into one
            triple, and `MIXES` random mixtures of different maps' channels.
        seed: of the mixtures.

    Returns:
        Without `blend` one triple a map, in alphabetical order; else coloured maps, grey ones, mixtures.
    """
    colours = [ChannelTriple(name, layout[name]) for name in layout if MAPS[name] == 3]
    grey = [layout[name][0] for name in layout if MAPS[name] == 1]
    if not blend:
        coloured = {p.kind: p for p in colours}
        single = {name: ChannelTriple(name, layout[name] * 3) for name in layout if MAPS[name] == 1}
        return [(coloured | single)[name] for name in sorted(layout)]
    triples = colours
    if grey:
        triples = [*triples, ChannelTriple("grey", tuple((grey * 3)[:3]))]
    return triples + (_mixes(layout, seed) if len(layout) > 1 else [])


def triple_images(exemplar: Exemplar, triples: list[ChannelTriple], layout: Layout) -> np.ndarray:
    """An exemplar's maps as P images, one for each triple: (P, H, W, 3) float32 in [0, 1], albedo sRGB."""
    values = {}
    for name, array in exemplar.maps.items():
        values |= {channel: array[..., k] for k, channel in enumerate(layout[name])}
    images = [np.stack([values[c] for c in p.channels], -1) for p in triples]
    return np.ascontiguousarray(np.stack(images), np.float32)


def _mixes(layout: Layout, seed: int) -> list[ChannelTriple]:
    """Random triples of channels out of as many different maps as there are."""
    rng = np.random.default_rng(seed)
    mixes = []
    for _ in range(MIXES):
        names = list(rng.permutation(sorted(layout)))
        maps = [(names * 3)[k] for k in range(3)]
        mixes.append(ChannelTriple("mix", tuple(int(rng.choice(layout[name])) for name in maps)))
    return mixes
