"""What patterns are drawn with: places, noise, and the cells of lattices.

Lengths are in elements: dots, stripes or bricks are about one apart. Random numbers of an element are hashes
of its place, so that a pattern can be drawn on any surface.
"""

from __future__ import annotations

import math
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
