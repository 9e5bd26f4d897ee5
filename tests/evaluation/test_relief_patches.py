"""Patches of a relief are seen along the surface below it, and show slopes and bends."""

import numpy as np
import pytest

from mitex.evaluation.relief_patches import SLANT, relief_cameras, relief_views
from mitex.geometry.vectors import unit
from mitex.mesh import grid, icosphere
from mitex.mesh.mesh import Mesh

SIDE = 32


@pytest.fixture(scope="module")
def ball():
    return icosphere(24)


def spiky(ball: Mesh) -> Mesh:
    """Every 40th vertex pulled out: normals at the spikes say nothing of the ball."""
    out = np.where(np.arange(len(ball.vertices)) % 40 == 0, 1.25, 1.0)
    return ball.with_vertices(ball.vertices * out[:, None])


def test_spikes_do_not_turn_the_view(ball):
    """Half of the cameras look along the radius of the ball, the others 45 degrees from it."""
    cameras = relief_cameras(spiky(ball), 8, 0.5, SIDE)
    cosines = -(cameras.axes()[2] * unit(cameras.target.astype(np.float64))).sum(1)
    angles = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
    assert angles[::2].max() < 8
    assert angles[1::2] == pytest.approx(np.full(4, SLANT), abs=8)


def test_normals_and_curvature_of_a_ball(ball):
    """Its normal (x, y, z) is at (x, y) of the picture; it bends by 2 / radius everywhere."""
    views = relief_views(ball, relief_cameras(ball, 1, 0.4, SIDE))
    (normals,), (mask,) = views["normals"]
    assert mask.all()
    across = (np.arange(SIDE) + 0.5) / SIDE * 0.4 - 0.2
    expected = np.stack([*np.meshgrid(across, -across)], axis=2)
    assert 2 * normals[..., :2] - 1 == pytest.approx(expected, abs=0.01)
    middle = views["curvature"][0][0, SIDE // 2, SIDE // 2]
    bend = 2 * 0.4 / SIDE  # divergence of the normal for each pixel
    assert 2 * middle - 1 == pytest.approx(np.tanh(2 * np.array([1, 2, 4]) * bend), rel=0.05)


def test_inside_out_it_is_concave(ball):
    inner = Mesh(ball.vertices, ball.faces[:, ::-1])
    images, mask = relief_views(inner, relief_cameras(inner, 2, 0.4, SIDE))["curvature"]
    assert images[0, 8:24, 8:24].max() < 0.5 and mask[0].all()


def test_a_plane_is_flat_and_what_is_beside_it_does_not_count():
    plane = grid(8, 8)
    views = relief_views(plane, relief_cameras(plane, 2, 3.0, SIDE))
    normals, mask = views["normals"]
    assert not mask.all() and mask.any()
    assert normals[0] == pytest.approx(np.broadcast_to((0.5, 0.5, 1.0), normals[0].shape), abs=1e-5)
    assert views["curvature"][0][0] == pytest.approx(0.5, abs=1e-5)


def test_cameras_depend_on_the_seed_alone(ball):
    first, same, other = (relief_cameras(ball, 2, 0.4, SIDE, seed) for seed in (0, 0, 1))
    assert np.array_equal(first.origin, same.origin)
    assert not np.array_equal(first.origin, other.origin)
