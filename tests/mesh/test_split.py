"""Meshes whose long edges are split."""

import numpy as np
import pytest

from mitex.errors import MeshError
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh, grid, icosphere, split
from mitex.mesh.nearest import surface_points
from mitex.mesh.split import split_with_values
from mitex.mesh.topology import boundary_edges, mesh_edges


def longest(mesh: Mesh) -> float:
    pairs, _ = mesh_edges(mesh.faces, len(mesh.vertices))
    return float(np.linalg.norm(mesh.vertices[pairs[:, 0]] - mesh.vertices[pairs[:, 1]], axis=1).max())


def split_long_edges(mesh: Mesh, length: float) -> Mesh:
    return split_with_values(mesh, length, np.zeros((len(mesh.vertices), 0)))[0]


def uneven() -> Mesh:
    """A square with its UVs, whose columns become ever narrower."""
    mesh = grid(5, 3)
    return mesh.with_vertices(np.sign(mesh.vertices) * np.abs(mesh.vertices) ** 3)


@pytest.mark.parametrize("length", [0.9, 0.31, 0.1])
@pytest.mark.parametrize("mesh", [icosphere(2), uneven()], ids=["ball", "uneven"])
def test_no_edge_is_longer_and_the_surface_is_the_same(mesh: Mesh, length: float):
    fine = split_long_edges(mesh, length)
    assert longest(fine) <= length
    np.testing.assert_allclose(fine.face_areas.sum(), mesh.face_areas.sum(), rtol=1e-5)
    face, barycentric = surface_points(mesh, fine.vertices)
    on_it = interpolate(barycentric, mesh.vertices[mesh.faces[face]])
    np.testing.assert_allclose(on_it, fine.vertices, atol=1e-5)


def test_faces_beside_each_other_are_split_alike():
    """A closed mesh stays closed; the border of an open one has the same length."""
    ball = icosphere(3)
    narrow = ball.with_vertices(ball.vertices * np.array([1.0, 4.0, 0.3]))
    fine = split_long_edges(narrow, 0.2)
    assert not len(boundary_edges(fine.faces, len(fine.vertices)))
    open_mesh = split_long_edges(uneven(), 0.2)
    pairs = boundary_edges(open_mesh.faces, len(open_mesh.vertices))
    border = np.linalg.norm(open_mesh.vertices[pairs[:, 0]] - open_mesh.vertices[pairs[:, 1]], axis=1)
    np.testing.assert_allclose(border.sum(), 8.0, rtol=1e-5)


def test_uvs_and_windings_go_along():
    """The UVs of the square are a linear map of its places, before and after."""
    mesh = grid(2, 3)
    fine = split_long_edges(mesh, 0.2)
    assert fine.uv is not None
    np.testing.assert_allclose(fine.uv, 0.5 + 0.5 * fine.vertices[fine.faces][..., :2], atol=1e-6)
    assert (fine.face_normals[:, 2] > 0.99).all()


def test_short_edges_stay():
    mesh = icosphere(3)
    np.testing.assert_array_equal(split_long_edges(mesh, 2.0).faces, mesh.faces)
    half = split_long_edges(uneven(), 0.5)
    assert len(half.faces) < len(split_long_edges(uneven(), 0.1).faces)


def test_too_many_faces_are_refused(monkeypatch):
    monkeypatch.setattr(split, "MAX_FACES", 1000)
    with pytest.raises(MeshError, match="use longer ones"):
        split_long_edges(icosphere(3), 0.01)


def test_values_of_vertices_go_along():
    """Those that are linear in the places are so after."""
    mesh, matrix = icosphere(3), np.random.default_rng(0).normal(size=(3, 2))
    fine, values = split_with_values(mesh, 0.2, mesh.vertices @ matrix)
    assert len(fine.vertices) > len(mesh.vertices)
    np.testing.assert_allclose(values, fine.vertices @ matrix, atol=1e-6)
