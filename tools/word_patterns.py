"""The patterns of the captioned pictures: what is figure, what is ground, and how high."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import torch
from word_materials import blotches, clouds, cracks, fur, marble, mosaic, pebbles, speckles, wood
from word_places import Drawn, Place
from word_shapes import crosses, dots, flowers, hearts, leaves, rings, stars, triangles
from word_tilings import (
    bricks,
    checks,
    diamonds,
    grid,
    hexagons,
    knit,
    maze,
    plaid,
    scales,
    stripes,
    waves,
    weave,
    zigzag,
)


def plain(p: Place) -> Drawn:
    return Drawn(torch.ones_like(p.u), p.seed.expand_as(p.u), torch.zeros_like(p.u))


class Kind(NamedTuple):
    """A pattern as captions know it."""

    draw: Callable[[Place], Drawn]
    equal: bool = False  # figure and ground cannot be told apart
    directed: bool = False  # it runs along v
    elements: bool = True  # which may have colours of their own
    usual: tuple[tuple[str, str], ...] = ()  # colours that need not be said


KINDS = {
    "plain": Kind(plain, elements=False),
    "dots": Kind(dots),
    "rings": Kind(rings),
    "stars": Kind(stars),
    "flowers": Kind(flowers),
    "hearts": Kind(hearts),
    "triangles": Kind(triangles),
    "crosses": Kind(crosses),
    "leaves": Kind(
        leaves, usual=(("green", "brown"), ("green", "dark green"), ("light green", "dark green"))
    ),
    "stripes": Kind(stripes, equal=True, directed=True),
    "waves": Kind(waves, equal=True, directed=True),
    "zigzag": Kind(zigzag, equal=True, directed=True),
    "checks": Kind(checks, equal=True),
    "diamonds": Kind(diamonds, equal=True),
    "bricks": Kind(bricks, usual=(("red", "light grey"), ("brown", "light grey"), ("dark red", "grey"))),
    "grid": Kind(grid, elements=False),
    "plaid": Kind(plaid, equal=True, elements=False),
    "weave": Kind(weave, usual=(("beige", "brown"), ("light brown", "dark brown"))),
    "knit": Kind(knit),
    "scales": Kind(scales),
    "hexagons": Kind(hexagons),
    "pebbles": Kind(pebbles, usual=(("grey", "dark grey"), ("beige", "brown"), ("light grey", "black"))),
    "mosaic": Kind(mosaic),
    "cracks": Kind(cracks, elements=False),
    "blotches": Kind(blotches),
    "clouds": Kind(clouds, equal=True, elements=False, usual=(("white", "light blue"), ("white", "blue"))),
    "marble": Kind(
        marble, elements=False, usual=(("grey", "white"), ("dark grey", "white"), ("white", "black"))
    ),
    "speckles": Kind(speckles),
    "wood": Kind(
        wood,
        equal=True,
        directed=True,
        elements=False,
        usual=(("brown", "light brown"), ("dark brown", "brown")),
    ),
    "fur": Kind(
        fur, equal=True, directed=True, elements=False, usual=(("brown", "dark brown"), ("grey", "dark grey"))
    ),
    "maze": Kind(maze, elements=False),
}
