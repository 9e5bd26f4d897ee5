"""Patterns that repeat without gaps: stripes, checks, bricks, cloth."""

from __future__ import annotations

import math

import torch
from word_places import Drawn, Place, hashed, lattice, smooth_noise, wave


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


def maze(p: Place) -> Drawn:
    cell = lattice(p._replace(u=p.u * 1.3, v=p.v * 1.3))
    x = torch.where(cell.element < 0.5, cell.x, -cell.x)
    line = torch.minimum((x - cell.y).abs(), 1 - (x - cell.y).abs()) * 0.707 / 1.3
    inside = 0.14 - line
    return Drawn(p.edge(inside), p.seed.expand_as(p.u), (inside / 0.1).clamp(0, 1))
