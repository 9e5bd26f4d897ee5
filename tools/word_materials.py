"""Patterns without rows: stones, clouds, veins, fibres."""

from __future__ import annotations

import torch
from word_places import Drawn, Place, fractal, smooth_noise, voronoi, warped


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
