"""Isotropic remeshing."""

import sys

import numpy as np
import pytest

from mitex.errors import MeshError, MeshWarning, MissingPackage
from mitex.mesh import grid, icosphere, quality, remesh, validate


def test_names_the_extra_that_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(MissingPackage, match=r"pip install 'mitex\[remesh\]'"):
        remesh(icosphere(2), 100)


def test_too_few_vertices():
    with pytest.raises(MeshError, match="11 vertices are too few"):
        remesh(icosphere(2), 11)


@pytest.mark.parametrize("count", [300, 1500])
def test_an_uneven_sphere_becomes_even(count):
    pytest.importorskip("pymeshlab")
    sphere = icosphere(10)
    # Squeezed along the sphere towards one pole, so that edges differ but the surface does not.
    points = sphere.vertices + np.array([0.0, 0.75, 0.0], np.float32)
    uneven = sphere.with_vertices(points / np.linalg.norm(points, axis=1, keepdims=True))
    assert quality(uneven).edge_variation > 0.35
    even = remesh(uneven, count)
    report = quality(even)
    assert abs(report.vertices - count) < 0.06 * count
    assert report.edge_variation < 0.2
    assert report.odd_valence < 0.02
    assert (report.genus, report.components, report.boundary_edges) == (0, 1, 0)
    np.testing.assert_allclose(np.linalg.norm(even.vertices, axis=1), 1.0, atol=0.06)


def test_open_meshes_keep_their_border():
    pytest.importorskip("pymeshlab")
    even = remesh(grid(4, 12), 400)
    report = quality(even)
    assert report.genus == 0
    assert report.boundary_edges > 0
    assert even.face_areas.sum() == pytest.approx(4.0, rel=0.01)
    assert even.uv is None


def test_borders_that_have_too_many_edges_are_told():
    pytest.importorskip("pymeshlab")
    ball = icosphere(16)
    used = ball.vertices[ball.faces, 2].max(1) < 0.5
    with pytest.warns(MeshWarning, match="without a face"):
        bowl = validate(ball.vertices, ball.faces[used], name="bowl")
    with pytest.warns(
        MeshWarning, match=r"bowl has \d+ vertices after remeshing, not 30: edges along curved"
    ):
        assert len(remesh(bowl, 30).vertices) > 36
