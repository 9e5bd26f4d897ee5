"""Grey procedural textures that the flow network is trained on, and others, of other kinds, that judge it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from exemplar_kit import FINE, cells, downsample, grid, noise, relaxed_points, step

from mitex.colour import LUMINANCE
from mitex.exemplar import Exemplar

Pattern = Callable[[np.random.Generator], np.ndarray]  # a grey periodic texture (FINE, FINE), any range


class Kinds(NamedTuple):
    """Exemplars of the package by name, and patterns of which `count` are drawn each."""

    exemplars: tuple[str, ...]
    patterns: tuple[Pattern, ...]
    count: int


def fractal(rng: np.random.Generator) -> np.ndarray:
    """Clouds of random roughness and stretch."""
    return noise(rng, 10 ** rng.uniform(-2.2, -0.8), rng.uniform(0.4, 2.0), 2 ** rng.normal(0.0, 1.0))


def band(rng: np.random.Generator) -> np.ndarray:
    """Spots or stripes of one size, with soft or hard borders."""
    size = 10 ** rng.uniform(-2.2, -1.2)
    stretch = 2 ** rng.normal(0.0, 0.8)
    field = noise(rng, size, 2.5, stretch) - rng.uniform(0.0, 0.8) * noise(rng, 3 * size, 2.0, stretch)
    width = rng.uniform(0.1, 1.5)
    return step(-width, width, field / field.std() + rng.normal(0.0, 0.5))


def mosaic(rng: np.random.Generator) -> np.ndarray:
    """Voronoi cells of random greys with grooves."""
    x, y = grid()
    points = relaxed_points(rng, int(10 ** rng.uniform(2.3, 3.8)), int(rng.integers(0, 2)))
    cell, border = cells(points, x, y, 0.2 / len(points) ** 0.5 * rng.uniform(0.05, 0.3))
    groove = step(0.0, rng.uniform(0.05, 0.3) / len(points) ** 0.5, border)
    return groove * (0.5 + rng.uniform(0.0, 0.3) * rng.normal(0.0, 1.0, len(points))[cell])


def contours(rng: np.random.Generator) -> np.ndarray:
    """Level lines of smooth noise: marble."""
    field = noise(rng, 10 ** rng.uniform(-1.5, -0.6), 2.0, 2 ** rng.normal(0.0, 0.7))
    return np.sin(rng.uniform(3.0, 12.0) * (field + 0.05 * noise(rng, 0.02, 1.0)))


def waves(rng: np.random.Generator) -> np.ndarray:
    """A few plane waves in random directions."""
    x, y = grid()
    frequencies = np.round(rng.normal(0.0, 25.0, (6, 2)))
    phases = rng.random(6)
    turns = frequencies @ np.stack([x.ravel(), y.ravel()]) + phases[:, None]
    return np.sin(2.0 * np.pi * turns).sum(0).reshape(x.shape)


def bubbles(rng: np.random.Generator) -> np.ndarray:
    """Shaded balls that lie over each other."""
    image = np.zeros((FINE, FINE))
    for _ in range(1500):
        radius = round(FINE * 10 ** rng.uniform(-2.2, -1.3))
        dy, dx = np.mgrid[-radius : radius + 1, -radius : radius + 1] / radius
        inside = np.hypot(dx, dy) < 1
        rows, columns = ((np.arange(2 * radius + 1) + start) % FINE for start in rng.integers(0, FINE, 2))
        shade = rng.uniform(0.2, 1.0) * (1.0 + 0.5 * (dx + dy))
        image[np.ix_(rows, columns)] = np.where(inside, shade, image[np.ix_(rows, columns)])
    return image


TRAINED = Kinds(
    exemplars=("bricks", "cobblestone", "hexagons", "knit", "leather", "planks", "rust"),
    patterns=(fractal, band, mosaic, contours),
    count=12,
)
HELD_OUT = Kinds(exemplars=("lava", "scales", "wicker"), patterns=(waves, bubbles), count=2)


def textures(kinds: Kinds) -> np.ndarray:
    """All textures of some kinds, (N, 512, 512) float32 in [0, 1]: of the exemplars albedo and height."""
    images = []
    for name in kinds.exemplars:
        exemplar = Exemplar.load(name)
        images += [exemplar.maps["albedo"] @ LUMINANCE, exemplar.maps["height"][..., 0]]
    for index, pattern in enumerate(kinds.patterns):
        for seed in range(kinds.count):
            images.append(downsample(pattern(np.random.default_rng((index, seed))))[..., 0])
    return np.stack([_stretched(image) for image in images]).astype(np.float32)


def _stretched(image: np.ndarray) -> np.ndarray:
    low, high = np.percentile(image, [0.5, 99.5])
    return np.clip((image - low) / (high - low), 0.0, 1.0)
