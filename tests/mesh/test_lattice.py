"""The flat lattice whose opposite sides are joined."""

import numpy as np
import pytest

from mitex.errors import MeshError
from mitex.geometry.triangles import interpolate
from mitex.mesh import Lattice
from mitex.mesh.topology import boundary_edges, euler_characteristic, opposed_edges


@pytest.fixture(scope="module")
def lattice():
    return Lattice.of(12)


def test_the_square_is_filled_with_even_triangles(lattice):
    mesh = lattice.mesh
    assert (lattice.columns, lattice.rows, lattice.count) == (12, 14, 168)
    own = mesh.vertices[: lattice.count]
    assert own.min() >= 0 and own[:, :2].max() < lattice.columns and not own[:, 2].any()
    assert (mesh.edges.valence[: lattice.count] == 6).all()
    lengths = np.linalg.norm(mesh.vertices[mesh.edges.indices] - mesh.vertices[mesh.edges.rows], axis=1)
    assert lengths.min() > 0.98 and lengths.max() < 1.02
    whole = lengths[np.isin(mesh.edges.rows, np.arange(lattice.count))].mean()
    assert lattice.edge == pytest.approx(whole, rel=1e-6)
    assert np.allclose(mesh.face_normals, [0, 0, 1])


def test_copies_are_whole_periods_away(lattice):
    apart = (lattice.mesh.vertices - lattice.mesh.vertices[lattice.source]) / lattice.columns
    assert np.allclose(apart, np.rint(apart), atol=1e-6)
    assert np.array_equal(lattice.source[: lattice.count], np.arange(lattice.count))
    assert not np.rint(apart[: lattice.count]).any() and np.rint(apart[lattice.count :]).any(axis=1).all()


def test_points_lie_where_they_are_located(lattice, rng):
    """In the square, wherever in the plane the point is; on faces whose corners have all their neighbours."""
    points = np.concatenate([rng.uniform(-2, 3, (2000, 2)), [[0, 0], [1, 1], [-1e-17, 0.5], [0.5, -1e-17]]])
    face, barycentric = lattice.locate(points)
    assert barycentric.min() > -1e-5 and np.allclose(barycentric.sum(1), 1, atol=1e-6)
    corners = lattice.mesh.faces[face]
    place = interpolate(barycentric, lattice.mesh.vertices[corners])[:, :2] / lattice.columns
    away = place - points
    assert np.allclose(away, np.rint(away), atol=1e-5)
    assert place.min() > -1e-5 and place.max() < 1 + 1e-5
    assert (lattice.mesh.edges.valence[corners] == 6).all()


def test_points_whole_periods_apart_are_one(lattice, rng):
    points = rng.integers(0, 1024, (500, 2)) / 1024
    shifted = points + rng.integers(-3, 4, (500, 2))
    for one, other in zip(lattice.locate(points), lattice.locate(shifted), strict=True):
        assert np.array_equal(one, other)


def test_joined_sides_make_a_torus(lattice):
    joined = lattice.joined
    assert len(joined.vertices) == lattice.count and euler_characteristic(joined.faces, lattice.count) == 0
    assert (joined.edges.valence == 6).all()
    assert not len(boundary_edges(joined.faces, lattice.count))
    assert opposed_edges(joined.faces, lattice.count) == 0
    for vertex in (0, lattice.columns - 1, lattice.count - 1):
        start, end = joined.edges.indptr[vertex], joined.edges.indptr[vertex + 1]
        around = lattice.mesh.edges.indices[
            lattice.mesh.edges.indptr[vertex] : lattice.mesh.edges.indptr[vertex + 1]
        ]
        assert set(joined.edges.indices[start:end]) == set(lattice.source[around])


def test_too_few_columns():
    assert Lattice.of(4).rows == 4
    with pytest.raises(MeshError, match="3 columns"):
        Lattice.of(3)
