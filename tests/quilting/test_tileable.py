"""Quilts that go on at the opposite side: no step across a border, and seams that are closed."""

import numpy as np
import pytest

from mitex.quilting.matching import ArraySource
from mitex.quilting.plane import quilt
from tests.quilting.sources import SIDE, continued, crop_source, every, noise_source, periodic_image


def border_steps(values: np.ndarray, axis: int) -> tuple[float, float]:
    """Mean difference across the border, and the largest of those between rows inside."""
    moved = np.moveaxis(values, axis, 0)
    inside = np.square(np.diff(moved, axis=0)).mean(tuple(range(1, moved.ndim)))
    return float(np.square(moved[0] - moved[-1]).mean()), float(inside.max())


@pytest.mark.parametrize("size", [(100, 100), (90, 131), (32, 32)])
def test_tileable_has_no_border(size: tuple[int, int], rng: np.random.Generator):
    image = periodic_image(256, 1)
    corners = rng.integers(0, 256 - SIDE, (600, 2))
    source = crop_source(image, corners)
    texture = quilt(source, size, rng, tileable=True)
    assert texture.features.shape == (*size, 1) and texture.texel.shape == (*size, 2)
    for axis in (0, 1):
        across, inside = border_steps(texture.features, axis)
        assert across <= inside
    plain = quilt(source, size, rng)
    steps = [border_steps(plain.features, axis) for axis in (0, 1)]
    assert all(across > 2.0 * inside for across, inside in steps)


def test_tileable_puts_a_periodic_image_together(rng: np.random.Generator):
    """Two periods by one wrap without a flaw, as every crop is there."""
    image, corners = periodic_image(), every(1)
    texture = quilt(crop_source(image, corners), (128, 64), rng, tileable=True, nearest=1)
    corner = corners[texture.patch[20, 20]] + texture.texel[20, 20] - 20
    expected = continued(image, corner % 64, (128, 64))
    assert np.abs(texture.features - expected).max() < 1e-5


@pytest.mark.parametrize("axis", [0, 1])
def test_last_patches_lead_back_to_the_first(axis: int, rng: np.random.Generator):
    """Ramps between any two values: only a ramp that ends where the first one begins leaves no step."""
    ends = rng.random((2000, 2, 1, 1, 1))
    place = (np.arange(SIDE) / (SIDE - 1)).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
    ramps = (ends[:, 0] + (ends[:, 1] - ends[:, 0]) * place) + np.zeros((1, SIDE, SIDE, 1))
    source = ArraySource(ramps.astype(np.float32), rng.random((2000, 2)) * 1e4, float(SIDE))
    size = (75, 32) if axis == 0 else (32, 75)
    steps = []
    for _ in range(4):
        image = quilt(source, size, rng, tileable=True, nearest=4).features
        steps.append(np.abs(image - np.roll(image, 1, axis)).max())
    assert np.mean(steps) < 0.08


def test_wrapped_seam_is_closed(rng: np.random.Generator):
    """Down to where a column shows the last row's patches changes by one at most, around the border too."""
    source = noise_source(60, 1)
    for _ in range(8):
        texture = quilt(source, (64, 90), rng, tileable=True)
        first = texture.texel[:12, :, 0] == np.arange(12)[:, None]  # patches of the first row begin there
        depth = (~first).sum(0)
        assert np.ptp(depth) > 3
        assert np.abs(depth - np.roll(depth, 1)).max() <= 1
