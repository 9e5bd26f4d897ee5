"""Contrasts of patterns that are known in closed form."""

import numpy as np
import pytest
from scipy import ndimage

from mitex.errors import ImageError
from mitex.evaluation.contrast import contrast

ROWS, COLUMNS = np.indices((64, 80))
CHECKS = np.repeat(((ROWS + COLUMNS) % 2)[..., None], 3, axis=2).astype(np.float32)
NOISE = np.random.default_rng(0).random((64, 80, 3), dtype=np.float32)


def test_checks_of_one_texel():
    """Around a black texel four of nine are white; within all squares black and white are as many."""
    measured = contrast(CHECKS)
    assert measured.local == pytest.approx((0.5, 0.5, 0.5))
    assert measured.finest == pytest.approx(4 / 9)
    assert measured.squares == pytest.approx((0, 0, 0), abs=1e-9)


def test_squares_of_two_colours():
    """What differs from square to square alone has no local contrast."""
    board = ((ROWS // 16 + COLUMNS // 16) % 2)[..., None] * np.array([0.8, 0.4, 0.2])
    measured = contrast(board.astype(np.float32))
    assert measured.local == pytest.approx((0, 0, 0), abs=1e-6)
    assert measured.squares == pytest.approx((0.4, 0.2, 0.1), rel=1e-5)


def test_a_third_of_the_squares_are_flat():
    image = CHECKS.copy()
    image[:16] = 0.5
    low, middle, high = contrast(image).local
    assert (low, middle, high) == pytest.approx((0, 0.5, 0.5))


def test_a_blurred_copy_has_less():
    blurred = contrast(ndimage.gaussian_filter(NOISE, (1, 1, 0)))
    sharp = contrast(NOISE)
    assert blurred.finest < 0.4 * sharp.finest and blurred.local[1] < 0.6 * sharp.local[1]


def test_what_does_not_count():
    mask = np.ones((64, 80), bool)
    mask[:, 40:] = False
    image = NOISE.copy()
    image[:, 40:] = 1
    assert contrast(image, mask) == contrast(NOISE, mask)
    assert contrast(image).squares[0] > 2 * contrast(image, mask).squares[0]


@pytest.mark.parametrize(
    ("image", "mask", "message"),
    [
        (CHECKS, np.ones((4, 4), bool), "a mask of"),
        (CHECKS[:20, :20], None, "fewer than two squares"),
        (CHECKS, np.zeros((64, 80), bool), "fewer than two squares"),
    ],
)
def test_pictures_that_cannot_be_measured(image, mask, message):
    with pytest.raises(ImageError, match=message):
        contrast(image, mask)
