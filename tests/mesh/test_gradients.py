"""Derivatives of vertex values against polynomials and a loop over faces."""

import numpy as np
import pytest
from hypothesis import given, settings

from mitex.mesh import Mesh, grid, icosphere
from mitex.mesh.gradients import values_and_gradients
from tests.mesh.examples import meshes


def _hexagonal(rows: int = 7) -> Mesh:
    """A patch of equilateral triangles in a slanted plane."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows), np.arange(rows), indexing="ij"))
    along, across = np.array([0.6, 0.8, 0.0]), np.array([-0.64, 0.48, 0.6])
    points = (j + 0.5 * i)[:, None] * along + (np.sqrt(0.75) * i)[:, None] * across
    own = (np.arange(rows - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    faces = [[own, own + 1, own + rows], [own + 1, own + rows + 1, own + rows]]
    return Mesh(points, np.concatenate([np.stack(f, 1) for f in faces]))


def _apply(mesh, values):
    """Values (V,) and gradients (V, 3)."""
    table = (values_and_gradients(mesh) @ values).reshape(-1, 4)
    return table[:, 0], table[:, 1:]


def _slow(mesh: Mesh, values: np.ndarray) -> np.ndarray:
    """Face by face: the vector of the face's plane that gives the differences along two sides."""
    total, weight = np.zeros((len(mesh.vertices), 3)), np.zeros(len(mesh.vertices))
    points = mesh.vertices.astype(float)
    for face in mesh.faces:
        sides = points[face[1:]] - points[face[0]]
        normal = np.cross(*sides)
        area = np.linalg.norm(normal)
        system = np.stack([*sides, normal])
        gradient = np.linalg.solve(system, [*(values[face[1:]] - values[face[0]]), 0.0])
        for vertex in face:
            total[vertex] += area * gradient
            weight[vertex] += area
    return total / np.maximum(weight, 1e-300)[:, None]


def test_linear_functions_on_a_plane_are_exact(rng):
    """However irregular the plane is, and at its border too."""
    mesh = grid(6, 5)
    jitter = 0.1 * rng.normal(size=mesh.vertices.shape) * [1, 1, 0]
    mesh = mesh.with_vertices(mesh.vertices + jitter)
    slope = np.array([1.7, -0.6, 0.0])
    values, gradients = _apply(mesh, mesh.vertices @ slope + 0.3)
    np.testing.assert_allclose(values, mesh.vertices @ slope + 0.3)
    np.testing.assert_allclose(gradients, np.tile(slope, (len(values), 1)), atol=1e-5)


def test_quadratic_functions_on_even_triangles_are_exact():
    """Away from the border, where a vertex sees one side only."""
    mesh = _hexagonal()
    plane = np.linalg.qr(np.array([[0.6, 0.8, 0.0], [-0.64, 0.48, 0.6]]).T)[0]
    x, y = (mesh.vertices.astype(float) @ plane).T
    _, gradients = _apply(mesh, 0.4 * x**2 - 0.7 * x * y + 0.2 * y**2 + x)
    expected = np.column_stack([0.8 * x - 0.7 * y + 1, -0.7 * x + 0.4 * y]) @ plane.T
    inner = np.diff(mesh.edges.indptr) == 6
    assert inner.sum() == 25
    np.testing.assert_allclose(gradients[inner], expected[inner], atol=1e-4)
    assert np.abs(gradients - expected)[~inner].max() > 0.1  # so the test would tell


@settings(max_examples=40, deadline=None)
@given(meshes())
def test_any_mesh_against_the_loop(mesh):
    values = np.cos(np.arange(len(mesh.vertices)))
    areas = mesh.face_areas
    if areas.min() < 1e-3 * areas.max():
        return
    expected = _slow(mesh, values)
    _, gradients = _apply(mesh, values)
    np.testing.assert_allclose(gradients, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())


def test_on_a_sphere_gradients_are_near_those_of_the_surface():
    mesh = icosphere(24)
    points = mesh.vertices.astype(float)
    _, gradients = _apply(mesh, points[:, 1])
    expected = np.array([0, 1, 0]) - points[:, 1:2] * points
    assert np.abs(gradients - expected).max() < 0.02


def test_faces_without_area_do_not_count():
    """Neither a face that is a line nor one that is a point changes the gradients of the others."""
    mesh = grid(3, 3)
    more = np.array([[0, 1, 2], [5, 5, 6], [7, 7, 7]])  # three along a row, and repeated corners
    flat = Mesh(mesh.vertices, np.concatenate([mesh.faces, more]))
    values = np.sin(np.arange(len(mesh.vertices)))
    np.testing.assert_allclose(_apply(flat, values)[1], _apply(mesh, values)[1], atol=1e-12)


@pytest.mark.parametrize("points", [np.zeros((3, 3)), np.outer(np.arange(3), [1, 2, 3])])
def test_a_mesh_without_area_has_no_gradients(points):
    values, gradients = _apply(Mesh(points, np.array([[0, 1, 2]])), np.array([1.0, 5.0, 2.0]))
    assert values.tolist() == [1, 5, 2] and not gradients.any()


def test_a_vertex_without_faces_has_no_gradient():
    mesh = grid(2, 2)
    lonely = Mesh(np.concatenate([mesh.vertices, [[5, 5, 5]]]), mesh.faces)
    values, gradients = _apply(lonely, np.arange(10.0))
    assert values[-1] == 9 and not gradients[-1].any() and gradients[:-1].any()


@pytest.mark.parametrize("size", [1e-9, 1e9])
def test_gradients_are_in_mesh_units(size):
    mesh = icosphere(3)
    values = np.arange(len(mesh.vertices)) % 7.0
    _, gradients = _apply(mesh.with_vertices(size * mesh.vertices.astype(float)), values)
    np.testing.assert_allclose(size * gradients, _apply(mesh, values)[1], rtol=1e-4, atol=1e-5)
