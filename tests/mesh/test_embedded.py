"""The meshes that ship with Mitex."""

import warnings

import numpy as np
import pytest

from mitex.errors import MeshError
from mitex.mesh import Mesh, embedded, embedded_names, quality
from mitex.mesh.embedded import DATA

NAMES = embedded_names()


@pytest.mark.parametrize("name", NAMES)
def test_suits_the_automaton(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh = embedded(name)
    report = quality(mesh)
    assert mesh.name == name
    assert 9_500 <= report.vertices <= 15_000
    assert report.edge_variation < 0.13
    assert report.odd_valence < 0.006
    assert report.valence[1] == pytest.approx(6.0, abs=0.02)
    assert (report.components, report.non_manifold_edges) == (1, 0)
    assert report.genus is not None
    np.testing.assert_allclose(mesh.vertices.mean(axis=0), 0.0, atol=1e-5)
    assert np.linalg.norm(mesh.vertices, axis=1).max() == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_faces_outwards(name):
    mesh = embedded(name)
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    assert (a * np.cross(b, c)).sum() > 0.0


def test_variety():
    assert len(NAMES) >= 4
    assert quality(embedded("knot")).genus == 1
    assert quality(embedded("vase")).boundary_edges > 0
    assert len(embedded("octopus").faces) > 20_000


def test_size_and_license():
    assert sum(path.stat().st_size for path in DATA.iterdir()) < 3_000_000
    assert "CC0" in (DATA / "LICENSE.txt").read_text()


def test_loads_by_name():
    assert len(Mesh.load(NAMES[0]).vertices) == len(embedded(NAMES[0]).vertices)


def test_unknown_names():
    with pytest.raises(MeshError, match="did you mean octopus"):
        embedded("octopuss")
    with pytest.raises(MeshError, match="did you mean octopus"):
        Mesh.load("octopuss")
    with pytest.raises(MeshError, match="use one of knot, "):
        embedded("../secret")
