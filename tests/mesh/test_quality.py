"""The quality report."""

import math

import numpy as np
import pytest

from mitex.mesh import Mesh, grid, icosphere, quality, torus
from tests.mesh.examples import OCTAHEDRON, OCTAHEDRON_POINTS, octahedron


def test_numbers_of_an_octahedron():
    report = quality(octahedron())
    assert (report.vertices, report.faces) == (6, 8)
    assert report.valence == (4, 4.0, 4)
    assert report.odd_valence == 1.0
    assert report.edge_length == pytest.approx(math.sqrt(2.0))
    assert report.edge_variation == pytest.approx(0.0, abs=1e-7)
    assert (report.components, report.boundary_edges, report.non_manifold_edges) == (1, 0, 0)
    assert (report.euler, report.genus) == (2, 0)


def test_edge_variation():
    # Sides 3, 4 and 5: mean 4, standard deviation sqrt(2 / 3).
    mesh = Mesh(np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]), np.array([[0, 1, 2]]))
    report = quality(mesh)
    assert report.edge_length == pytest.approx(4.0)
    assert report.edge_variation == pytest.approx(math.sqrt(2.0 / 3.0) / 4.0)


@pytest.mark.parametrize(("mesh", "genus"), [(torus(8, 6), 1), (icosphere(2), 0), (grid(3, 3), 0)])
def test_genus(mesh, genus):
    assert quality(mesh).genus == genus


def test_genus_of_several_pieces():
    ring = torus(8, 6)
    vertices = np.concatenate([ring.vertices, ring.vertices + 9.0, OCTAHEDRON_POINTS - 9.0])
    faces = np.concatenate([ring.faces, ring.faces + 48, OCTAHEDRON + 96])
    report = quality(Mesh(vertices, faces))
    assert (report.components, report.euler, report.genus) == (3, 2, 2)
    assert any("separate components: 3" in line for line in report.advice)


def test_genus_of_what_is_not_a_surface():
    points = np.concatenate([OCTAHEDRON_POINTS, [[2.0, 2.0, 2.0]]])
    report = quality(Mesh(points, np.concatenate([OCTAHEDRON, [[0, 2, 6]]])))
    assert report.genus is None
    assert any("more than two faces: 1" in line for line in report.advice)
    # A Moebius strip of five triangles has no consistent winding.
    strip = np.array([[k, (k + 1) % 5, (k + 2) % 5] for k in range(5)])
    assert quality(Mesh(np.random.default_rng(0).normal(size=(5, 3)), strip)).genus is None


def test_a_good_mesh_gets_no_advice():
    assert quality(icosphere(64)).advice == ()


@pytest.mark.parametrize(
    ("vertices", "rounds"), [(10_368, 1), (2_562, 2), (40_962, 0), (20_000, 1), (21_000, 0), (600_000, 0)]
)
def test_suggested_subdivisions(vertices, rounds):
    # V 4^n is then nearest to 40,962 by ratio.
    ratios = [abs(math.log(vertices * 4**n / 40_962)) for n in range(6)]
    assert int(np.argmin(ratios)) == rounds
    mesh = Mesh(np.random.default_rng(0).normal(size=(vertices, 3)), np.array([[0, 1, 2]]))
    assert quality(mesh).subdivisions == rounds


def test_advice_on_density():
    (line,) = quality(icosphere(32)).advice
    assert "subdivide 1 time (about 40,968 vertices)" in line
    assert "2.0 times as large" in line
    (line,) = quality(icosphere(32), target=2_562).advice
    assert "remesh(mesh, 2562)" in line
    assert "2.0 times as small" in line
    assert quality(icosphere(16), target=2_562).advice == ()


def test_advice_on_uneven_meshes():
    stretched = Mesh(icosphere(16).vertices * np.array([6.0, 1.0, 1.0], np.float32), icosphere(16).faces)
    lines = quality(stretched, target=2_562).advice
    assert len(lines) == 1
    assert "edge lengths vary by" in lines[0]
    assert "mitex[remesh]" in lines[0]
    assert "fewer than 5 or more than 7" not in lines[0]
    assert "fewer than 5 or more than 7" in quality(octahedron()).advice[0]
