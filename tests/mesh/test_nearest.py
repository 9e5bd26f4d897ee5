"""The nearest points of a mesh, against distances to all its faces."""

import numpy as np
import pytest

from mitex.geometry.triangles import interpolate, nearest_on_triangles
from mitex.mesh import Mesh, grid, icosphere, scattered_sphere
from mitex.mesh.nearest import nearest_points


def _places(mesh: Mesh, face, barycentric):
    return interpolate(barycentric, mesh.vertices[mesh.faces[face]])


@pytest.mark.parametrize("mesh", [icosphere(5), scattered_sphere(200), grid(4, 3)], ids=str)
def test_they_are_as_near_as_any(mesh, rng):
    """Of points on the surface, and of some a tenth of an edge away from it."""
    face = rng.integers(len(mesh.faces), size=150)
    length = np.sqrt(mesh.face_areas[face])[:, None]
    points = _places(mesh, face, rng.dirichlet(np.ones(3), 150)) + 0.1 * length * rng.normal(size=(150, 3))
    nearest, weights = nearest_points(mesh, points)
    assert (nearest.dtype, weights.dtype) == (np.int32, np.float32)
    distance = np.linalg.norm(_places(mesh, nearest, weights) - points, axis=1)
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    for point, value in zip(points, distance, strict=True):
        _, every = nearest_on_triangles(corners, np.broadcast_to(point, (len(corners), 3)))
        assert value == pytest.approx(every.min(), abs=1e-6)
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.sum(1), 1, atol=1e-6)


def test_a_mesh_of_few_faces():
    """Fewer than are tried."""
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]))
    face, weights = nearest_points(mesh, np.array([[1.0, 1, 1], [5, 0, 0]]))
    assert face.tolist() == [0, 0]
    np.testing.assert_allclose(weights, [[1 / 3] * 3, [1, 0, 0]], atol=1e-6)
