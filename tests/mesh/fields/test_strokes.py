"""Fields that follow strokes: planes and spheres with known answers, and what is refused."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import lpmv

from mitex.errors import ConfigError
from mitex.mesh import Mesh, grid, icosphere, scattered_sphere
from mitex.mesh.fields import stroke_vectors, vector_field


def arc(latitude: float = 0.0, turn: float = 2 * np.pi, points: int = 65) -> np.ndarray:
    """Eastwards around the y axis on the unit sphere."""
    angle = np.linspace(0.0, turn, points)
    reach = np.cos(latitude)
    return np.stack([reach * np.sin(angle), 0 * angle + np.sin(latitude), reach * np.cos(angle)], axis=1)


def even_plane(rows: int) -> Mesh:
    """Equilateral triangles, with shifted vertices: no angle is above 90 degrees."""
    j, i = np.divmod(np.arange(rows * rows), rows)
    shift = np.random.default_rng(0).uniform(-0.08, 0.08, (rows * rows, 2))
    points = np.stack([i + 0.5 * j, np.sqrt(0.75) * j], axis=1) + shift
    a = (j * rows + i)[(i < rows - 1) & (j < rows - 1)]
    faces = [np.stack([a, a + 1, a + rows], axis=1), np.stack([a + 1, a + rows + 1, a + rows], axis=1)]
    return Mesh(np.column_stack([points, 0 * i]), np.concatenate(faces))


def test_equal_strokes_on_a_plane_give_a_constant_field():
    direction = np.array([0.6, 0.8, 0.0])
    strokes = [start + np.outer([0.0, 0.3, 0.7], direction) for start in ([-0.9, -0.9, 0], [0.2, 0.1, 0.02])]
    vectors = stroke_vectors(grid(20, 20), strokes)
    np.testing.assert_allclose(vectors, np.tile(direction, (441, 1)), atol=1e-9)


def stiffness(mesh: Mesh) -> np.ndarray:
    """(V, V): f K f is the integral of |grad f|^2, where f is linear on each triangle; in the plane."""
    matrix = np.zeros((len(mesh.vertices),) * 2)
    for face in mesh.faces:
        sides = np.diff(mesh.vertices[face, :2].astype(np.float64), axis=0)
        gradient = np.linalg.solve(sides, [[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
        matrix[np.ix_(face, face)] += 0.5 * abs(np.linalg.det(sides)) * gradient.T @ gradient
    return matrix


def test_components_on_a_plane_are_harmonic():
    mesh, fixed = even_plane(7), np.array([8, 40])
    middle = mesh.vertices[fixed].astype(np.float64)
    strokes = [middle[:1] + [[-0.1, 0, 0], [0.1, 0, 0]], middle[1:] + [[0, 0.1, 0], [0, -0.1, 0]]]
    free = np.setdiff1d(np.arange(49), fixed)
    matrix = stiffness(mesh)
    expected = np.zeros((49, 3))
    expected[fixed] = [[1, 0, 0], [0, -1, 0]]
    pull = -matrix[np.ix_(free, fixed)] @ expected[fixed]
    expected[free] = np.linalg.solve(matrix[np.ix_(free, free)], pull)
    np.testing.assert_allclose(stroke_vectors(mesh, strokes), expected, atol=1e-9)


def east_of(points: np.ndarray) -> np.ndarray:
    """(V, 3) unit vectors across the y axis."""
    east = np.cross([0.0, 1.0, 0.0], points)
    return east / np.maximum(np.linalg.norm(east, axis=1, keepdims=True), 1e-9)


def test_a_stroke_along_the_equator_of_a_sphere():
    mesh = icosphere(12)
    vectors = stroke_vectors(mesh, [arc()])
    speed = (vectors * east_of(mesh.vertices)).sum(axis=1)
    np.testing.assert_allclose(speed[np.abs(mesh.vertices[:, 1]) < 0.9], 1.0, atol=0.01)


def test_two_strokes_around_a_sphere():
    """Eastwards at the equator, westwards in the north.

    f(t) e_phi is harmonic if f'' + cot t f' = cot^2 t f, as Legendre's functions of order 1 are for the
    degree v with v (v + 1) = 1. f is 1 at one circle and 0 at the other.
    """
    mesh, north, v = icosphere(16), np.sin(0.9), (np.sqrt(5.0) - 1.0) / 2.0
    height = mesh.vertices[:, 1].astype(np.float64)
    between = (height > 0) & (height < north)
    ends = np.array([[lpmv(1, v, s), lpmv(1, v, -s)] for s in (0.0, north)])
    values = np.stack([lpmv(1, v, height[between]), lpmv(1, v, -height[between])], axis=1)
    of_south, of_north = np.abs(values @ np.linalg.inv(ends)).T
    vectors = stroke_vectors(mesh, [arc(), arc(0.9)[::-1]])
    error = (vectors * east_of(mesh.vertices)).sum(axis=1)[between]
    error -= (of_south - of_north) / (of_south + of_north)
    # A stroke is as wide as a row of vertices.
    assert np.abs(error).max() < 0.1
    assert np.abs(error).mean() < 0.03


def test_the_field_turns_with_the_mesh():
    mesh, stroke = scattered_sphere(300), arc(0.3, 2.0, 9)
    turn = Rotation.from_rotvec([0.4, -1.3, 0.8])
    turned = mesh.with_vertices(turn.apply(mesh.vertices.astype(np.float64)))
    vectors = stroke_vectors(mesh, [stroke, -stroke])
    of_turned = stroke_vectors(turned, [turn.apply(stroke), turn.apply(-stroke)])
    np.testing.assert_allclose(of_turned, turn.apply(vectors), atol=1e-5)
    assert np.linalg.norm(vectors, axis=1).max() <= 1 + 1e-9


def two_balls() -> Mesh:
    ball = icosphere(3)
    vertices = np.concatenate([ball.vertices, ball.vertices + [5, 0, 0]])
    return Mesh(vertices, np.concatenate([ball.faces, ball.faces + len(ball.vertices)]))


def test_nothing_moves_where_no_stroke_reaches():
    vectors = stroke_vectors(two_balls(), [arc()])
    assert np.linalg.norm(vectors[:92], axis=1).max() == pytest.approx(1.0)
    assert not vectors[92:].any()


def test_a_file_of_strokes(tmp_path):
    ball = icosphere(4)
    (tmp_path / "strokes.json").write_text(json.dumps({"strokes": [arc().tolist()]}))
    expected = vector_field(ball, stroke_vectors(ball, [arc()]))
    np.testing.assert_array_equal(vector_field(ball, tmp_path / "strokes.json"), expected)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "holds no strokes"),
        ("[]", "holds no strokes"),
        ('{"strokes": 3}', "holds no strokes"),
        ('{"strokes": [[[1, 0]]]}', "holds no strokes"),
        ('{"strokes": [[[1, 0, 0], [1, 0]]]}', "holds no strokes"),
        ('{"strokes": [[1, 0, 0]]}', "holds no strokes"),
        ('{"strokes": []}', "there are no strokes"),
        ('{"strokes": [[[1, 0, 0], [1, 0, NaN]]]}', "not three finite numbers"),
        ('{"strokes": [[[1, 0, 0], [1, 0, 0]]]}', "has no length"),
        ('{"strokes": [[[1, 0, 0]]]}', "has no length"),
        ('{"strokes": [[[1, 0, 0], [0, 1, 0]], [[0, 0, 9], [1, 0, 0]]]}', "stroke 2 is 8 away"),
        ('{"strokes": [[[0, 0.9, 0], [0, 1.1, 0]]]}', "no direction along the surface"),
    ],
)
def test_refuses_files_without_strokes(tmp_path, text, problem):
    (tmp_path / "strokes.json").write_text(text)
    with pytest.raises(ConfigError, match=problem):
        vector_field(icosphere(4), tmp_path / "strokes.json")
