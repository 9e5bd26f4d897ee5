"""Hulls of a ball, whose silhouettes are discs."""

import numpy as np
import pytest

from mitex.methods.nerf.capture.visual_hull import View, project, visual_hull

RADIUS = 0.5
AROUND = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 1, 1), (-1, 1, 1)]
NO_LENS = np.zeros(4)


def looking(back, target=(0.0, 0.0, 0.0), distance=3.0):
    back = np.array(back, float) / np.linalg.norm(back)
    right = np.cross((0.3, 0.5, 0.8), back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back, np.array(target) + distance * back], axis=1)


def view(pose, size=64, focal=100.0):
    """The ball of RADIUS at the origin as a camera sees it."""
    x, y = np.meshgrid(*[np.arange(size) + 0.5 - size / 2] * 2)
    rays = np.stack([x, -y, np.full_like(x, -focal)], axis=-1) @ pose[:, :3].T
    nearest = pose[:, 3] - (rays @ pose[:, 3] / (rays**2).sum(-1))[..., None] * rays
    mask = np.linalg.norm(nearest, axis=-1) < RADIUS
    return View(mask, pose, np.array([focal, focal, size / 2, size / 2]), NO_LENS)


def test_hull_contains_the_ball_and_little_else():
    hull = visual_hull([view(looking(back)) for back in AROUND])
    assert hull is not None
    directions = np.random.default_rng(0).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert hull.contains(RADIUS * directions).all()
    assert hull.contains(np.zeros((1, 3))).all()
    assert not hull.contains(1.6 * RADIUS * directions).any()
    low, high = hull.bounds()
    assert (low < -RADIUS).all() and (low > -1.2 * RADIUS).all()
    assert (high > RADIUS).all() and (high < 1.2 * RADIUS).all()


def test_what_is_outside_of_a_frame_is_carved():
    """The frames end just beyond the ball: side views must carve what stands above it all the same."""
    tight = [view(looking(back), 64, 180.0) for back in AROUND]
    assert all(v.whole for v in tight)
    hull = visual_hull(tight)
    assert hull is not None
    low, high = hull.bounds()
    assert (low > -1.2 * RADIUS).all() and (high < 1.2 * RADIUS).all()


def test_frames_that_cut_the_ball_carve_nothing_beyond():
    close = [view(looking(back), 64, 300.0) for back in AROUND[:2]]
    assert not any(v.whole for v in close)
    hull = visual_hull([view(looking(back)) for back in AROUND] + close)
    assert hull is not None and hull.contains(0.99 * RADIUS * np.eye(3)).all()


def test_large_masks_are_carved_as_small_ones():
    small = visual_hull([view(looking(back)) for back in AROUND])
    large = visual_hull([view(looking(back), 600, 900.0) for back in AROUND])
    assert small is not None and large is not None
    assert np.allclose(small.bounds(), large.bounds(), atol=0.04)


def test_nothing_is_left_of_cameras_in_a_row():
    """The axes have no nearest point, so no masks tell how far the object is."""
    poses = [looking((0, 0, 1), (0.02 * k, 0, 0)) for k in range(8)]
    assert visual_hull([view(pose) for pose in poses]) is None


def test_nothing_is_left_of_masks_that_disagree():
    corner = np.zeros((64, 64), bool)
    corner[:8, :8] = True
    views = [view(looking(back)) for back in AROUND]
    assert visual_hull([View(corner, v.pose, v.intrinsics, v.distortion) for v in views]) is None


def test_projection_by_hand():
    """A camera at (0, 0, 5) that looks down -z: 4 in front of it, a unit to the right and up is f / 4."""
    pose = np.concatenate([np.eye(3), [[0.0], [0.0], [5.0]]], axis=1)
    pixels, depth = project(np.array([[1.0, 1.0, 1.0]]), pose, np.array([80.0, 40.0, 32.0, 30.0]), NO_LENS)
    assert pixels == pytest.approx(np.array([[52.0, 20.0]])) and depth == pytest.approx([4.0])
