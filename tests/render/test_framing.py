"""Cameras that fill the picture."""

import math

import numpy as np
import pytest

from mitex.render.framing import FOV, MARGIN, View, fit_view, hull, rotation


def project(points: np.ndarray, view: View) -> np.ndarray:
    """Picture coordinates in [-1, 1] by the definition of a pinhole."""
    forward = (view.target - view.origin) / np.linalg.norm(view.target - view.origin)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    to = points - view.origin
    depth = to @ forward
    assert (depth > 0).all()
    return np.stack([to @ right, to @ up], axis=1) / depth[:, None] / math.tan(FOV / 2)


@pytest.mark.parametrize("elevation", [0.0, 0.3, 1.4, -0.8])
@pytest.mark.parametrize("stretch", [(1, 1, 1), (0.1, 1, 1), (1, 0.05, 1), (0.05, 0.05, 1), (3, 0.2, 0.2)])
def test_all_points_are_inside_and_some_touch(elevation, stretch, rng):
    points = rng.normal(size=(200, 3)) * stretch + [0.3, -2.0, 1.0]
    screen = np.abs(project(points, fit_view(points, elevation)))
    assert screen.max() <= 1 - MARGIN + 1e-6
    assert screen.max() > 1 - MARGIN - 0.01 or stretch == (0.05, 0.05, 1)


def test_the_fuller_axis_is_centred(rng):
    points = rng.normal(size=(200, 3)) * [2.0, 0.5, 0.5]
    screen = project(points, fit_view(points, 0.2))[:, 0]
    np.testing.assert_allclose([screen.min(), screen.max()], [MARGIN - 1, 1 - MARGIN], atol=1e-6)


def test_azimuth_turns_the_named_side_to_the_camera():
    np.testing.assert_allclose(rotation(0.0) @ [0, 0, 1], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(rotation(math.pi / 2) @ [1, 0, 0], [0, 0, 1], atol=1e-12)
    assert np.linalg.det(rotation(0.7)) == pytest.approx(1.0)


def test_hull_keeps_what_is_outermost(rng):
    points = rng.normal(size=(500, 3))
    few = hull(points)
    assert len(few) < 200
    for direction in rng.normal(size=(20, 3)):
        assert (few @ direction).max() == (points @ direction).max()


def test_hull_of_flat_objects_is_everything(rng):
    flat = rng.normal(size=(50, 3)) * [1, 0, 1]
    np.testing.assert_array_equal(hull(flat), flat)
