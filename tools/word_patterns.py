"""The patterns of the captioned pictures: what is figure, what is ground, and how high.

Lengths are in elements: dots, stripes or bricks are about one apart. Random numbers of an element are hashes
of its place, so that a pattern can be drawn on any surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import torch


class Place(NamedTuple):
    """Where a batch of patterns is drawn."""

    u: torch.Tensor  # (B, H, W), to the right
    v: torch.Tensor  # (B, H, W), down
    pixel: torch.Tensor  # (B, 1, 1), the width of a pixel
    seed: torch.Tensor  # (B, 1, 1) in [0, 1)

    def random(self, index: int, low: float = 0.0, high: float = 1.0) -> torch.Tensor:
        """(B, 1, 1): a number of each pattern."""
        return low + (high - low) * hashed(self.seed * 91.7, torch.full_like(self.seed, index + 0.5))

    def edge(self, distance: torch.Tensor) -> torch.Tensor:
        """1 inside, 0 outside, with a soft border of one pixel, from the distance inwards."""
        return (0.5 + distance / self.pixel).clamp(0, 1)


class Drawn(NamedTuple):
    """A batch of patterns, (B, H, W) each."""

    figure: torch.Tensor  # 1 on the figure, 0 on the ground
    element: torch.Tensor  # a random number in [0, 1) of each element
    height: torch.Tensor  # about 0 to 1


def hashed(i: torch.Tensor, j: torch.Tensor, seed: torch.Tensor | float = 0.0) -> torch.Tensor:
    """A random number in [0, 1) of each pair."""
    return (torch.sin(i * 12.9898 + j * 78.233 + seed * 37.719) * 43758.5453).remainder(1.0)


def smooth_noise(u: torch.Tensor, v: torch.Tensor, seed: torch.Tensor) -> torch.Tensor:
    """Hashes of whole places, interpolated, in [0, 1)."""
    i, j = u.floor(), v.floor()
    x, y = u - i, v - j
    x, y = x * x * (3 - 2 * x), y * y * (3 - 2 * y)
    top = torch.lerp(hashed(i, j, seed), hashed(i + 1, j, seed), x)
    return torch.lerp(top, torch.lerp(hashed(i, j + 1, seed), hashed(i + 1, j + 1, seed), x), y)


def fractal(u: torch.Tensor, v: torch.Tensor, seed: torch.Tensor, octaves: int = 4) -> torch.Tensor:
    """Noise of several sizes, mean 0.5."""
    parts = [smooth_noise(u * 2**k, v * 2**k, seed + 0.37 * k) / 2**k for k in range(octaves)]
    return torch.stack(parts).sum(0) / (2 - 2 / 2**octaves)


def warped(p: Place, amount: float, size: float = 1.0) -> Place:
    """The place, bent by noise."""
    u = p.u + amount * (smooth_noise(p.u / size, p.v / size, p.seed + 3.1) - 0.5)
    v = p.v + amount * (smooth_noise(p.u / size, p.v / size, p.seed + 5.7) - 0.5)
    return p._replace(u=u, v=v)


class Cell(NamedTuple):
    """Nearest element of a lattice: the place from its middle, its random number, its indices."""

    x: torch.Tensor
    y: torch.Tensor
    element: torch.Tensor


def lattice(p: Place, brick: torch.Tensor | float = 0.0, jitter: float = 0.0) -> Cell:
    """Square cells of width 1; every second row is moved by `brick`."""
    j = p.v.floor()
    u = p.u + brick * (j % 2)
    i = u.floor()
    element = hashed(i, j, p.seed)
    x, y = u - i - 0.5, p.v - j - 0.5
    return Cell(x + jitter * (element - 0.5), y + jitter * (hashed(j, i, p.seed) - 0.5), element)


def turned(cell: Cell, turns: torch.Tensor) -> Cell:
    """The cell, turned about its middle."""
    cos, sin = torch.cos(2 * math.pi * turns), torch.sin(2 * math.pi * turns)
    return cell._replace(x=cos * cell.x + sin * cell.y, y=cos * cell.y - sin * cell.x)


def voronoi(p: Place, jitter: float = 0.9) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Distances to the nearest and second nearest of scattered points, and the nearest one's number."""
    i, j = p.u.floor(), p.v.floor()
    first, second, element = torch.full_like(i, 9.0), torch.full_like(i, 9.0), torch.zeros_like(i)
    for a in (-1, 0, 1):
        for b in (-1, 0, 1):
            number = hashed(i + a, j + b, p.seed)
            x = i + a + 0.5 + jitter * (number - 0.5) - p.u
            y = j + b + 0.5 + jitter * (hashed(j + b, i + a, p.seed + 0.6) - 0.5) - p.v
            distance = torch.hypot(x, y)
            second = torch.minimum(second, torch.maximum(first, distance))
            element = torch.where(distance < first, number, element)
            first = torch.minimum(first, distance)
    return first, second, element


def wave(x: torch.Tensor) -> torch.Tensor:
    """0 at whole numbers, 1 between them, straight in between."""
    return 1 - (2 * x.remainder(1.0) - 1).abs()


def shapes(p: Place, cell: Cell, inside: torch.Tensor) -> Drawn:
    """Separate shapes from the distance to their borders, slightly raised."""
    return Drawn(p.edge(inside), cell.element, (inside / 0.15).clamp(0, 1) ** 0.5)


def scattered(p: Place) -> Cell:
    """Cells for separate shapes: in straight or shifted rows, somewhat out of place in some pictures."""
    rows = (p.random(1) < 0.5) * 0.5
    return lattice(p, rows, 0.15)


def plain(p: Place) -> Drawn:
    return Drawn(torch.ones_like(p.u), p.seed.expand_as(p.u), torch.zeros_like(p.u))


def dots(p: Place) -> Drawn:
    cell = scattered(p)
    return shapes(p, cell, p.random(2, 0.24, 0.38) - torch.hypot(cell.x, cell.y))


def rings(p: Place) -> Drawn:
    cell = scattered(p)
    return shapes(p, cell, p.random(2, 0.07, 0.1) - (torch.hypot(cell.x, cell.y) - 0.3).abs())


def stars(p: Place) -> Drawn:
    cell = turned(scattered(p), p.random(3))
    angle = torch.atan2(cell.y, cell.x) / (2 * math.pi) * 5
    return shapes(p, cell, 0.17 + 0.25 * (1 - wave(angle)) ** 1.3 - torch.hypot(cell.x, cell.y))


def flowers(p: Place) -> Drawn:
    cell = turned(scattered(p), p.random(3))
    radius = torch.hypot(cell.x, cell.y)
    petals = 0.31 + 0.12 * torch.cos(5 * torch.atan2(cell.y, cell.x)) - radius
    return shapes(p, cell, torch.minimum(petals, radius - 0.09))


def hearts(p: Place) -> Drawn:
    cell = scattered(p)
    x, y = cell.x.abs(), 0.05 - cell.y
    lobes = 0.2 - torch.hypot(x - 0.15, y - 0.12)
    tip = torch.minimum((0.36 - x + y * 0.9) * 0.7, 0.14 - y)
    return shapes(p, cell, torch.maximum(lobes, torch.minimum(tip, 0.34 - x)))


def triangles(p: Place) -> Drawn:
    cell = turned(scattered(p), p.random(3))
    sides = torch.maximum(cell.y, 0.866 * cell.x.abs() - 0.5 * cell.y)
    return shapes(p, cell, 0.21 - sides)


def crosses(p: Place) -> Drawn:
    cell = turned(scattered(p), (p.random(3) < 0.4) * 0.125)
    x, y = cell.x.abs(), cell.y.abs()
    return shapes(p, cell, torch.minimum(0.1 - torch.minimum(x, y), 0.38 - torch.maximum(x, y)))


def leaves(p: Place) -> Drawn:
    cell = lattice(p, 0.5, 0.25)
    cell = turned(cell, p.random(3) + 0.15 * (cell.element - 0.5))
    lens = 0.68 - torch.hypot(cell.x.abs() + 0.48, cell.y)
    rib = 0.025 - cell.x.abs()
    return shapes(p, cell, torch.minimum(lens, -rib))


def stripes(p: Place) -> Drawn:
    share = p.random(1, 0.4, 0.6)
    inside = share / 2 - (p.u.remainder(1.0) - 0.5).abs()
    return Drawn(p.edge(inside), hashed(p.u.floor(), p.seed), (inside / 0.2).clamp(0, 1))


def waves(p: Place) -> Drawn:
    size = p.random(2, 1.5, 2.5)
    return stripes(p._replace(u=p.u + p.random(3, 0.3, 0.55) * torch.sin(2 * math.pi * p.v / size)))


def zigzag(p: Place) -> Drawn:
    return stripes(p._replace(u=p.u + p.random(3, 0.7, 1.0) * wave(p.v / p.random(2, 1.4, 2.0))))


def checks(p: Place) -> Drawn:
    i, j = p.u.floor(), p.v.floor()
    even = (i + j) % 2 * 2 - 1
    border = torch.minimum(0.5 - (p.u - i - 0.5).abs(), 0.5 - (p.v - j - 0.5).abs())
    return Drawn(p.edge(even * border), hashed(i, j, p.seed), (border / 0.15).clamp(0, 1) ** 0.5)


def diamonds(p: Place) -> Drawn:
    return checks(p._replace(u=p.u + 0.6 * p.v, v=p.u - 0.6 * p.v))


def bricks(p: Place) -> Drawn:
    cell = lattice(p._replace(u=p.u / 1.5, v=p.v * 1.3), 0.5)
    border = torch.minimum((0.5 - cell.x.abs()) * 1.5, (0.5 - cell.y.abs()) / 1.3) - p.random(1, 0.05, 0.09)
    return Drawn(p.edge(border), cell.element, (border / 0.08).clamp(0, 1))


def grid(p: Place) -> Drawn:
    border = torch.minimum(0.5 - (p.u.remainder(1.0) - 0.5).abs(), 0.5 - (p.v.remainder(1.0) - 0.5).abs())
    inside = p.random(1, 0.06, 0.13) - border
    return Drawn(p.edge(inside), p.seed.expand_as(p.u), (inside / 0.06).clamp(0, 1))


def plaid(p: Place) -> Drawn:
    across, down = stripes(p).figure, stripes(p._replace(u=p.v)).figure
    lines = torch.maximum(*(p.edge(0.04 - (x.remainder(1.0) - 0.02).abs()) for x in (p.u, p.v)))
    return Drawn(
        torch.maximum((across + down) / 2, lines),
        p.seed.expand_as(p.u),
        0.3 * smooth_noise(p.u * 8, p.v * 8, p.seed),
    )


def weave(p: Place) -> Drawn:
    i, j = p.u.floor(), p.v.floor()
    x, y = p.u - i - 0.5, p.v - j - 0.5
    across = (i + j) % 2 > 0
    strand = 3 * torch.where(across, y, x) + 0.5
    end = 0.5 - torch.where(across, x, y).abs()
    inside = torch.minimum(0.36 - (strand.remainder(1.0) - 0.5).abs(), 6 * end - 0.1) / 3
    height = (inside / 0.1).clamp(0, 1) * torch.cos(2 * (0.5 - end))
    return Drawn(p.edge(inside), hashed(i + strand.floor() / 3, j, p.seed), height)


def knit(p: Place) -> Drawn:
    i, j = p.u.floor(), (p.v * 1.3).floor()
    x, y = p.u - i - 0.5, p.v * 1.3 - j - 0.5
    slant = (y + 0.75 - 1.4 * x.abs()).remainder(1.0) - 0.5
    stitch = torch.minimum(0.38 - slant.abs(), (0.5 - x.abs()) * 1.6)
    inside = torch.minimum(stitch, (x.abs() - 0.04) * 2)
    return Drawn(p.edge(inside), hashed(i, j, p.seed), (inside / 0.25).clamp(0, 1) ** 0.7)


def scales(p: Place) -> Drawn:
    figure, element, height = torch.zeros_like(p.u), torch.zeros_like(p.u), torch.zeros_like(p.u)
    for row in (2, 1, 0):  # from the lowest scales to those that lie upon them
        j = (p.v * 2).floor() - row
        u = p.u + 0.5 * (j % 2)
        radius = torch.hypot(u - u.floor() - 0.5, p.v - j / 2)
        scale = radius < 0.56
        figure = torch.where(scale, p.edge(0.48 - radius), figure)
        element = torch.where(scale, hashed(u.floor(), j, p.seed), element)
        height = torch.where(scale, radius / 0.56, height)
    return Drawn(figure, element, height)


def hexagons(p: Place) -> Drawn:
    nearest = []
    for shift in (0.0, 0.5):
        i, j = (p.u + shift).round(), (p.v / 1.732 + shift).round()
        nearest.append((p.u + shift - i, (p.v / 1.732 + shift - j) * 1.732, hashed(i, j + 7 * shift, p.seed)))
    (x, y, a), (s, t, b) = nearest
    other = torch.hypot(s, t) < torch.hypot(x, y)
    x, y, element = torch.where(other, s, x).abs(), torch.where(other, t, y).abs(), torch.where(other, b, a)
    border = 0.5 - torch.maximum(x, 0.5 * x + 0.866 * y) - p.random(1, 0.04, 0.09)
    return Drawn(p.edge(border), element, (border / 0.12).clamp(0, 1))


def pebbles(p: Place) -> Drawn:
    first, second, element = voronoi(p, 0.75)
    inside = (second - first) / 2 - p.random(1, 0.05, 0.09) + 0.04 * (0.5 - first)
    return Drawn(p.edge(inside), element, (inside / 0.25).clamp(0, 1) ** 0.5)


def mosaic(p: Place) -> Drawn:
    first, second, element = voronoi(p)
    inside = (second - first) / 2 - 0.035
    return Drawn(p.edge(inside), element, (inside / 0.04).clamp(0, 1))


def cracks(p: Place) -> Drawn:
    bent = warped(warped(p, 0.5, 0.6), 0.2, 0.2)
    first, second, element = voronoi(bent)
    inside = p.random(1, 0.03, 0.06) - (second - first) / 2
    return Drawn(p.edge(inside), element, (-inside / 0.08).clamp(0, 1))


def blotches(p: Place) -> Drawn:
    field = fractal(p.u * 0.9, p.v * 0.9, p.seed, 3)
    inside = (field - p.random(1, 0.47, 0.54)) * 1.5
    return Drawn(p.edge(inside), smooth_noise(p.u * 0.7, p.v * 0.7, p.seed + 2), (inside / 0.1).clamp(0, 1))


def clouds(p: Place) -> Drawn:
    field = ((fractal(p.u * 0.7, p.v * 0.7, p.seed, 5) - 0.5) * 3 + 0.5).clamp(0, 1)
    return Drawn(field, p.seed.expand_as(p.u), field)


def marble(p: Place) -> Drawn:
    bent = warped(p, 2.0, 1.6)
    field = fractal(bent.u * 0.5, bent.v * 0.5, p.seed, 4)
    vein = (1 - (field - 0.5).abs() / 0.05).clamp(0, 1) ** 1.5
    fine = (1 - (fractal(bent.v * 0.8, bent.u * 0.8, p.seed + 4, 3) - 0.5).abs() / 0.03).clamp(0, 1)
    return Drawn(torch.maximum(vein, 0.6 * fine), p.seed.expand_as(p.u), torch.zeros_like(vein))


def speckles(p: Place) -> Drawn:
    first, _, element = voronoi(p._replace(u=p.u * 2.5, v=p.v * 2.5, pixel=p.pixel * 2.5))
    inside = 0.1 + 0.35 * (element * 7.3).remainder(1.0) - first
    return Drawn(p.edge(inside), element, (inside / 0.2).clamp(0, 1))


def wood(p: Place) -> Drawn:
    bent = (
        p.u
        + 0.9 * smooth_noise(p.u * 0.4, p.v * 0.12, p.seed)
        + 0.5 * smooth_noise(p.u, p.v * 0.3, p.seed + 1)
    )
    ring = bent.remainder(1.0) ** 1.6
    fibre = smooth_noise(p.u * 12, p.v * 0.8, p.seed + 2) - 0.5
    return Drawn((ring + 0.35 * fibre).clamp(0, 1), p.seed.expand_as(p.u), 1 - ring)


def fur(p: Place) -> Drawn:
    bent = warped(p, 1.2, 1.5)
    hair = (
        smooth_noise(bent.u * 5, bent.v * 0.8, p.seed) + smooth_noise(bent.u * 9, bent.v * 1.3, p.seed + 1)
    ) / 2
    hair = ((hair - 0.5) * 2.6 + 0.5).clamp(0, 1)
    return Drawn(hair, smooth_noise(bent.u * 5, bent.v * 0.8, p.seed + 2), hair)


def maze(p: Place) -> Drawn:
    cell = lattice(p._replace(u=p.u * 1.3, v=p.v * 1.3))
    x = torch.where(cell.element < 0.5, cell.x, -cell.x)
    line = torch.minimum((x - cell.y).abs(), 1 - (x - cell.y).abs()) * 0.707 / 1.3
    inside = 0.14 - line
    return Drawn(p.edge(inside), p.seed.expand_as(p.u), (inside / 0.1).clamp(0, 1))


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
