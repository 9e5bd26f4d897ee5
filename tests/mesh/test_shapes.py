"""Icosphere, torus, grid."""

import numpy as np
import pytest

from mitex.errors import MeshError
from mitex.mesh import Mesh, grid, icosphere, quality, scattered_sphere, torus


def volume(mesh: Mesh) -> float:
    """Signed volume; positive if the faces are counter-clockwise from outside."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(float) for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("frequency", [1, 2, 3, 7])
def test_icosphere(frequency):
    sphere = icosphere(frequency)
    assert len(sphere.vertices) == 10 * frequency**2 + 2
    assert len(sphere.faces) == 20 * frequency**2
    np.testing.assert_allclose(np.linalg.norm(sphere.vertices, axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(sphere.vertices.mean(axis=0), 0.0, atol=1e-6)
    assert (
        np.bincount(sphere.edges.valence).tolist()[5:] == [12, 10 * frequency**2 - 10][: 1 + (frequency > 1)]
    )
    assert quality(sphere).genus == 0
    assert len(np.unique(sphere.vertices.round(5), axis=0)) == len(sphere.vertices)
    assert volume(sphere) > 0.0


def test_icosphere_of_the_paper():
    sphere = icosphere(64)
    assert len(sphere.vertices) == 40_962
    report = quality(sphere)
    assert report.edge_length == pytest.approx(0.0188, abs=2e-4)
    assert report.edge_variation < 0.052
    assert volume(sphere) == pytest.approx(4.0 / 3.0 * np.pi, rel=1e-3)


def test_icosphere_contains_the_coarser_one():
    coarse, fine = icosphere(3), icosphere(6)
    distance = np.linalg.norm(coarse.vertices[:, None] - fine.vertices[None], axis=2).min(axis=1)
    # The corners and edges exactly; inside the faces the two divide slightly differently.
    assert (distance < 1e-6).sum() >= 12 + 30 * 2
    assert distance.max() < 0.02


def test_torus():
    mesh = torus(40, 24, radius=2.0, tube=0.5)
    assert len(mesh.vertices) == 960
    assert np.unique(mesh.edges.valence).tolist() == [6]
    assert quality(mesh).genus == 1
    reach = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2]) - 2.0
    np.testing.assert_allclose(np.hypot(reach, mesh.vertices[:, 1]), 0.5, atol=1e-6)
    assert volume(mesh) == pytest.approx(2.0 * np.pi**2 * 2.0 * 0.25, rel=0.03)


def test_grid():
    mesh = grid(3, 2)
    assert (len(mesh.vertices), len(mesh.faces)) == (12, 12)
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.vertices[mesh.faces][..., :2], 2.0 * mesh.uv - 1.0, atol=1e-6)
    assert mesh.face_areas.sum() == pytest.approx(4.0)
    assert (mesh.face_normals[:, 2] == 1.0).all()


@pytest.mark.parametrize(
    "make",
    [
        lambda: icosphere(0),
        lambda: torus(5, 8),
        lambda: torus(2, 8),
        lambda: torus(8, 2),
        lambda: torus(8, 8, 1.0, 1.0),
        lambda: torus(8, 8, 1.0, 0.0),
        lambda: grid(0, 3),
    ],
)
def test_impossible_shapes(make):
    with pytest.raises(MeshError, match="not possible"):
        make()


class TestScatteredSphere:
    def test_it_is_a_closed_sphere_facing_outwards(self):
        mesh = scattered_sphere(500, 3)
        assert len(mesh.vertices) == 500 and len(mesh.faces) == 996
        np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, rtol=1e-6)
        centres = mesh.vertices[mesh.faces].mean(axis=1)
        assert (np.einsum("fk,fk->f", mesh.face_crosses, centres) > 0).all()
        pairs = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]))
        assert (np.unique(pairs, axis=0, return_counts=True)[1] == 2).all()

    def test_it_is_uneven(self):
        mesh = scattered_sphere(2000)
        graph = mesh.edges
        lengths = np.linalg.norm(mesh.vertices[graph.indices] - mesh.vertices[graph.rows], axis=1)
        assert lengths.std() / lengths.mean() == pytest.approx(0.28, abs=0.02)
        valence = np.diff(graph.indptr)
        assert valence.min() <= 4 and valence.max() >= 8

    def test_places_follow_the_seed(self):
        one, again, other = (scattered_sphere(50, seed).vertices for seed in (0, 0, 1))
        assert np.array_equal(one, again) and not np.array_equal(one, other)

    def test_too_few(self):
        with pytest.raises(MeshError, match="3 vertices"):
            scattered_sphere(3)
