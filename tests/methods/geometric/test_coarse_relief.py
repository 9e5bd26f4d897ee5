"""The coarse part of a relief: what is measured, and what is drawn like it."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import Legendre
from scipy.spatial import KDTree

from mitex.geometry.vectors import unit
from mitex.mesh import Mesh, icosphere
from mitex.methods.geometric.coarse_relief import WIDTHS, CoarseRelief, split

BALL = icosphere(16)
EDGE = float(BALL.edge_lengths.mean())


def with_heights(heights: np.ndarray) -> Mesh:
    return BALL.with_vertices(BALL.vertices * (1 + EDGE * heights[:, None]))


def bumps(side: float, count: int = 40, width: float = 3.0) -> Mesh:
    """Round ones around points that are evenly spread, one edge high and so many wide."""
    k = np.arange(count)
    angle, y = np.pi * (3 - 5**0.5) * k, 1 - 2 * (k + 0.5) / count
    ring = np.sqrt(1 - y * y)
    centres = np.stack([ring * np.sin(angle), y, ring * np.cos(angle)], 1)
    away, _ = KDTree(centres).query(BALL.vertices)
    return with_heights(side * np.exp(-((away / (0.5 * width * EDGE)) ** 2)))


def waves(cycles: float) -> Mesh:
    """Waves of random directions, so many around the ball."""
    rng = np.random.default_rng(1)
    ways = cycles * unit(rng.normal(size=(80, 3)))
    return with_heights(np.cos(BALL.vertices @ ways.T + rng.uniform(0, 6.3, 80)).sum(1) / np.sqrt(40))


def test_a_ball_has_no_relief():
    base, relief, coarse = split(BALL)
    assert np.allclose(base.vertices, BALL.vertices, atol=2e-3)
    assert np.abs(relief).max() < 0.05 * EDGE and coarse.spread < 0.02


@pytest.mark.parametrize("side", [1, -1])
def test_bumps_and_dents_are_counted(side):
    base, relief, coarse = split(bumps(side))
    assert coarse.side == side and coarse.faces == len(BALL.faces) / 40
    assert np.linalg.norm(base.vertices, axis=1).std() < 0.1 * EDGE
    assert 0.05 < coarse.spread < 0.5
    assert np.allclose(np.cross(relief, base.normals), 0, atol=1e-6)  # along the normals


def test_waves_are_no_bumps():
    assert split(waves(20))[2].faces == 0


def test_only_the_band_between_both_filters_counts():
    """Waves in it, half as long as the finest filter keeps, and much longer than the widest one lets by."""
    lengths = 7, 2.2 * WIDTHS[0], 12 * WIDTHS[-1]
    middle, short, long = (split(waves(2 * np.pi / (length * EDGE)))[2].spread for length in lengths)
    assert middle > 1.9 * short and middle > 9 * long


def test_waves_are_in_the_band_of_their_length():
    """Spherical harmonics of degree n; between two filters, the length pi sqrt(2 fine wide) passes best."""
    for band, (fine, wide) in enumerate(pairwise(WIDTHS)):
        degree = round(2 * np.pi / (np.pi * np.sqrt(2 * fine * wide) * EDGE) - 0.5)
        bands = split(with_heights(Legendre.basis(degree)(BALL.vertices[:, 1])))[2].bands
        assert np.argmax(bands) == band


SHARES = (0.5, 0.4, 0.2, 0.1)


@pytest.mark.parametrize(
    "coarse", [CoarseRelief(0.2, SHARES), CoarseRelief(0.3, SHARES, 80, 1), CoarseRelief(0.3, SHARES, 80, -1)]
)
def test_what_is_drawn_is_like_what_was_measured(coarse):
    draw = coarse.on(BALL)
    heights = ((draw(0) - BALL.vertices) * BALL.normals).sum(1) / EDGE
    assert heights.std() == pytest.approx(coarse.spread, rel=1e-3) and abs(heights.mean()) < 1e-3
    skewness = np.mean(heights**3) / heights.std() ** 3
    assert skewness * coarse.side > 0.5 if coarse.faces else abs(skewness) < 0.3
    assert np.array_equal(draw(0), draw(0)) and not np.allclose(draw(0), draw(1))
    again = split(BALL.with_vertices(draw(0)))[2]
    assert bool(again.faces) == bool(coarse.faces)
    assert np.argsort(again.bands)[:2].tolist() == [3, 2]
    if coarse.faces:
        assert again.faces == pytest.approx(coarse.faces, rel=0.02) and again.side == coarse.side


def test_what_is_drawn_has_the_size_of_edges():
    coarse = CoarseRelief(0.3, SHARES)
    large = BALL.with_vertices(5 * BALL.vertices)
    assert np.allclose(coarse.on(large)(2), 5 * coarse.on(BALL)(2), atol=1e-4)
