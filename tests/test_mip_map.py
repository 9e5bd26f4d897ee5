"""Filtered lookup against means that are known."""

import numpy as np
import pytest

from mitex.mip_map import MipMap

SQUARE = np.eye(2)[None]


def checkerboard(height, width):
    rows, columns = np.mgrid[:height, :width]
    return ((rows + columns) % 2)[..., None].astype(float)


def many(places, footprint):
    return places, np.broadcast_to(footprint, (len(places), 2, 2))


def test_at_full_resolution_it_gives_the_texels(rng):
    image = rng.random((6, 10, 3))
    rows, columns = (index.ravel() for index in np.mgrid[:6, :10])
    centres = np.column_stack([columns, rows]) + 0.5
    for footprint in (SQUARE, 0.2 * SQUARE, (1 + 1e-6) * SQUARE, SQUARE @ [[0, 1], [-1, 0]]):
        np.testing.assert_allclose(MipMap(image)(*many(centres, footprint)), image[rows, columns], atol=1e-5)


def test_it_repeats_beyond_the_borders(rng):
    image = rng.random((6, 10, 3))
    places, size = rng.uniform(0, 6, (40, 2)), np.array([10, 6])
    for footprint in (SQUARE, np.diag([7.0, 2.0])):
        shift = size * rng.integers(-3, 3, (40, 2))
        here, there = (MipMap(image)(*many(places + by, footprint)) for by in (0, shift))
        np.testing.assert_allclose(here, there, atol=1e-9)


@pytest.mark.parametrize("size", [(64, 64), (32, 64)])
@pytest.mark.parametrize("footprint", [8.0, 16.7, 1000.0])
def test_a_checkerboard_far_below_a_pixel_is_its_mean(size, footprint, rng):
    places = rng.uniform(0, 64, (50, 2))
    values = MipMap(checkerboard(*size))(*many(places, footprint * SQUARE))
    np.testing.assert_allclose(values, 0.5, atol=1e-12)


@pytest.mark.parametrize("size", [(7, 7), (12, 5), (1, 9)])
def test_a_pixel_that_covers_all_shows_the_mean(size, rng):
    image = rng.random((*size, 2))
    values = MipMap(image)(*many(rng.uniform(0, 9, (5, 2)), 100 * SQUARE))
    np.testing.assert_allclose(values, np.broadcast_to(image.mean((0, 1)), (5, 2)), atol=1e-12)


@pytest.mark.parametrize("turn", [np.eye(2), np.array([[0, -1], [1, 0]])])
def test_a_long_footprint_averages_along_itself_alone(turn):
    """Stripes: along them they stay sharp, across them they are averaged."""
    image = np.broadcast_to((np.arange(64) % 8 < 4)[None, :, None], (64, 64, 1)).astype(float)
    places = np.column_stack([np.arange(64) + 0.5, np.full(64, 30.5)])
    along, across = (np.diag(lengths) @ turn for lengths in ((1.0, 32.0), (32.0, 1.0)))
    np.testing.assert_allclose(MipMap(image)(*many(places, along)), image[30], atol=1e-9)
    np.testing.assert_allclose(MipMap(image)(*many(places, across)), 0.5, atol=1e-9)


@pytest.mark.parametrize(
    "footprint", [np.diag([6.0, 6.0]), [[9.0, 0.0], [4.0, 5.0]], [[4.0, -4.0], [30.0, 30.0]]]
)
def test_it_is_the_mean_over_the_parallelogram(footprint, rng):
    """Against a thousand texels of each footprint, of an image without order; one texel is far from them."""
    image = rng.random((64, 64, 3))
    places, steps = rng.uniform(0, 64, (50, 2)), (np.arange(60) + 0.5) / 60 - 0.5
    inner = np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2) @ np.array(footprint).T
    column, row = np.moveaxis(np.floor(places[:, None] + inner).astype(int) % 64, 2, 0)
    expected = image[row, column].mean(1)
    values = MipMap(image)(*many(places, np.array(footprint)))
    error, spread = np.sqrt(np.square(values - expected).mean()), expected.std()
    assert error < 0.45 * spread, (error, spread)


@pytest.mark.parametrize("angle", [30, 80])
def test_a_wave_fades_as_the_mean_over_the_footprint(angle, rng):
    """A wave of 16 texels under footprints that are long across it, against the integral."""
    image = 0.5 + 0.5 * np.sin(2 * np.pi * (np.arange(64) + 0.5) / 16)[None, :, None] * np.ones((64, 1, 1))
    length = 1 / np.cos(np.radians(angle))
    places = rng.uniform(0, 64, (100, 2))
    values = MipMap(image)(*many(places, np.diag([length, 1.0])))
    phase = np.pi * length / 16
    expected = 0.5 + 0.5 * np.sin(2 * np.pi * places[:, :1] / 16) * np.sin(phase) / phase
    np.testing.assert_allclose(values, expected, atol=0.015)
