"""Ambient occlusion against closed forms."""

import numpy as np
import pytest

from mitex.mesh import Mesh, icosphere
from mitex.scenes import occlusion as room
from mitex.scenes.occlusion import ambient_occlusion

UP = np.array([0.0, 1.0, 0.0])


def wall(size: float) -> Mesh:
    """The plane x = 0 above y = 0."""
    points = np.array([[0, 0, -size], [0, 0, size], [0, size, size], [0, size, -size]])
    return Mesh(points, np.array([[0, 1, 2], [0, 2, 3]]))


def test_nothing_above_a_convex_body():
    sphere = icosphere(8)
    centres = sphere.vertices[sphere.faces].mean(1)
    assert np.array_equal(ambient_occlusion(sphere, centres, sphere.face_normals, 32), np.ones(len(centres)))


def test_nothing_is_free_inside():
    sphere = icosphere(4)
    centres = sphere.vertices[sphere.faces].mean(1)
    assert not ambient_occlusion(sphere, centres, -sphere.face_normals, 32).any()


@pytest.mark.parametrize("distance", [0.1, 1.0, 3.0])
def test_the_foot_of_a_wall(distance):
    """A wall of height h at distance d hides (1 - d / sqrt(d^2 + h^2)) / 2 of a cosine-weighted sky."""
    size, height = 60.0, 2.0
    mesh = wall(size)
    mesh = mesh.with_vertices(mesh.vertices * [1, height / size, 1])
    occlusion = ambient_occlusion(mesh, np.array([[distance, 0.0, 0.0]]), UP[None], 1 << 16)
    hidden = 0.5 * (1 - distance / np.hypot(distance, height))
    assert occlusion[0] == pytest.approx(1 - hidden, abs=0.01)


def test_points_in_parts_are_the_same(monkeypatch):
    ball = icosphere(3)
    mesh = Mesh(
        np.concatenate([ball.vertices, 0.5 * ball.vertices + [0, 1.8, 0]]),
        np.concatenate([ball.faces, ball.faces + len(ball.vertices)]),
    )
    points, normals = ball.vertices.astype(float), ball.normals.astype(float)
    whole = ambient_occlusion(mesh, points, normals, 4096)
    monkeypatch.setattr(room, "RAYS", 4096 * 10)
    assert np.abs(ambient_occlusion(mesh, points, normals, 4096) - whole).max() < 0.05
    top = whole[ball.vertices[:, 1].argmax()]
    assert top == pytest.approx(
        1 - (0.5 / 0.8) ** 2, abs=0.03
    )  # a ball of radius r at distance d hides (r/d)^2


def test_same_seed_same_result():
    mesh = icosphere(3)
    points = mesh.vertices.astype(float)
    a, b = (ambient_occlusion(mesh, points, mesh.normals, 16, seed=3) for _ in range(2))
    assert np.array_equal(a, b)
