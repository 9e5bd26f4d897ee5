"""The lens model there and back."""

import numpy as np
import pytest

from mitex.methods.nerf.capture.distortion import distort, folds, undistort


@pytest.mark.parametrize("lens", [(-0.3, 0.1, 0.01, -0.02), (0.2, 0.05, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)])
def test_undistort_is_the_inverse(lens, rng):
    points = rng.uniform(-0.7, 0.7, (500, 2))
    assert np.abs(undistort(distort(points, np.array(lens)), np.array(lens)) - points).max() < 1e-8
    assert not folds(distort(points, np.array(lens)), np.array(lens))


def test_one_lens_for_each_point(rng):
    points, lenses = rng.uniform(-0.5, 0.5, (9, 2)), rng.normal(0.0, 0.05, (9, 4))
    each = [undistort(p[None], lens)[0] for p, lens in zip(points, lenses, strict=True)]
    assert np.allclose(undistort(points, lenses), each, atol=1e-9)


def test_a_lens_by_hand():
    """At (1, 2): r^2 = 5, radial 1 + 0.1 5 + 0.01 25 = 1.75; tangential by OpenCV's formula."""
    shift = [2 * 0.001 * 2 + 0.002 * (5 + 2), 0.001 * (5 + 8) + 2 * 0.002 * 2]
    point = distort(np.array([1.0, 2.0]), np.array([0.1, 0.01, 0.001, 0.002]))
    assert np.allclose(point, [1.75 + shift[0], 3.5 + shift[1]])


def test_a_barrel_that_turns_back_folds():
    """x (1 - x^2) never exceeds 0.385."""
    lens = np.array([-1.0, 0.0, 0.0, 0.0])
    assert folds(np.array([[0.5, 0.0]]), lens)
    assert not folds(np.array([[0.3, 0.0]]), lens)
