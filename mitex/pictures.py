"""Pictures: three channels of the maps, looked at as if they were RGB.

Image features see three channels at once. A picture that mixes channels of different maps looks right only if
those maps are in register, which ties them together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mitex.exemplar import MAPS, Exemplar

MIXES = 12
# The kinds of blended pictures; those that the maps do not give are left out.
CYCLE = ("albedo", "normal", "grey", "mix")

Layout = Mapping[str, tuple[int, ...]]  # name of a map -> its channels in a field


@dataclass(frozen=True)
class Picture:
    """Three channels looked at as if they were RGB: `channels` of the field; `kind` says why."""

    kind: str
    channels: tuple[int, ...]


def pictures_of(layout: Layout, blend: bool, seed: int) -> list[Picture]:
    """The pictures of a set of maps.

    Args:
        layout: the maps.
        blend: False gives every map by itself; True gives the coloured ones, the grey ones packed into one
            picture, and `MIXES` random mixtures of different maps' channels.
        seed: of the mixtures.
    """
    colours = [Picture(name, layout[name]) for name in layout if MAPS[name] == 3]
    grey = [layout[name][0] for name in layout if MAPS[name] == 1]
    if not blend:
        order = {p.kind: p for p in colours}
        single = {name: Picture(name, layout[name] * 3) for name in layout if MAPS[name] == 1}
        return [(order | single)[name] for name in sorted(layout)]
    pictures = colours
    if grey:
        pictures = [*pictures, Picture("grey", tuple((grey * 3)[:3]))]
    return pictures + (_mixes(layout, seed) if len(layout) > 1 else [])


def picture_images(exemplar: Exemplar, pictures: list[Picture], layout: Layout) -> np.ndarray:
    """The pictures (P, H, W, 3) float32 of an exemplar's maps."""
    values = {}
    for name, array in exemplar.maps.items():
        values |= {channel: array[..., k] for k, channel in enumerate(layout[name])}
    images = [np.stack([values[c] for c in p.channels], -1) for p in pictures]
    return np.ascontiguousarray(np.stack(images), np.float32)


def _mixes(layout: Layout, seed: int) -> list[Picture]:
    """Random triples of channels out of as many different maps as there are."""
    rng = np.random.default_rng(seed)
    mixes = []
    for _ in range(MIXES):
        names = list(rng.permutation(sorted(layout)))
        chosen = [(names * 3)[k] for k in range(3)]
        mixes.append(Picture("mix", tuple(int(rng.choice(layout[name])) for name in chosen)))
    return mixes
