"""Motion in images against finite differences of projected points."""

import numpy as np
import pytest

from mitex.mesh import icosphere
from mitex.scenes.cameras import Cameras
from mitex.scenes.screen import screen_motion, surface_motion
from mitex.scenes.stage import Stage

ORIGIN, TARGET, UP = ([3.0, 1, 2], [-1, 2, 3]), ([0.1, 0, 0], [0, 0.2, 0]), ([0, 1.0, 0], [0.3, 1, 0])


def _pixels(cameras, camera, points):
    """Column and row of points, from the rays' definition: the screen goes from -1 to 1."""
    origins, directions = (terms.astype(np.float64)[camera] for terms in cameras.basis())
    out = []
    for o, d, point in zip(origins, directions, points, strict=True):
        # o0 + x o1 + y o2 + t (d0 + x d1 + y d2) = point; by Newton's method from in front of the camera.
        x = np.array([0, 0, 2.0])
        for _ in range(20):
            here = o[0] + x[0] * o[1] + x[1] * o[2] + x[2] * (d[0] + x[0] * d[1] + x[1] * d[2])
            columns = [o[1] + x[2] * d[1], o[2] + x[2] * d[2], d[0] + x[0] * d[1] + x[1] * d[2]]
            x = x + np.linalg.solve(np.stack(columns, 1), point - here)
        out.append(((x[0] + 1) / 2 * cameras.width, (1 - x[1]) / 2 * cameras.height))
    return np.array(out)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_it_is_the_derivative_of_the_projection(kind):
    cameras = Cameras(kind, np.array(ORIGIN), np.array(TARGET), np.array(UP), 45, 1.3, width=96, height=64)
    rng = np.random.default_rng(0)
    points, velocities = 0.4 * rng.normal(size=(2, 20, 3))
    camera = np.arange(20) % 2
    step = 1e-5
    ends = [_pixels(cameras, camera, points + s * velocities) for s in (-step, step)]
    expected = (ends[1] - ends[0]) / (2 * step)
    assert np.allclose(screen_motion(cameras, camera, points, velocities), expected, rtol=1e-4, atol=1e-3)


def test_right_and_up_in_an_upright_image():
    """At distance 2, an image 90 degrees high is 4 units high."""
    place, up = np.array([[0, 0, 2.0]]), np.array([[0, 1.0, 0]])
    camera = Cameras("perspective", place, np.zeros((1, 3)), up, 90, height=80)
    motions = screen_motion(camera, np.zeros(3, int), np.zeros((3, 3)), np.eye(3))
    assert np.allclose(motions, [[20, 0], [0, -20], [0, 0]], atol=1e-5)


def test_a_surface_that_turns_in_two_images():
    """Seen along the axis and from its side; both images are 4 units high. Its background stands still."""
    places, up = np.array([[0, 3.0, 0], [0, 0, 3.0]]), np.array([[0, 0, -1.0], [0, 1.0, 0]])
    cameras = Cameras("orthographic", places, np.zeros((2, 3)), up, half_width=2.0, width=40, height=40)
    ball = icosphere(8)
    hits = Stage(ball).hits(cameras)
    motion = surface_motion(cameras, ball, hits, np.cross([0, 1.0, 0], ball.vertices))
    hit = hits.hit.numpy().reshape(2, 40, 40)
    assert motion.shape == (2, 40, 40, 2) and 0.1 < hit.mean() < 0.3
    assert (motion[~hit] == 0).all()
    row, column = np.nonzero(hit[0])
    assert np.allclose(motion[0, row, column], np.stack([row - 19.5, 19.5 - column], 1), atol=1e-3)
    row, column = np.nonzero(hit[1])
    depth = np.sqrt(np.maximum(100 - (row - 19.5) ** 2 - (column - 19.5) ** 2, 0))
    assert np.allclose(motion[1, row, column], np.stack([depth, 0 * depth], 1), atol=0.8)
