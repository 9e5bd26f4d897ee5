"""Distributions of local measurements."""

import numpy as np
import pytest

from mitex.evaluation.surface_statistics import local_statistics, statistic_distances
from mitex.mesh import Mesh, grid, icosphere


def test_a_plane():
    statistics = local_statistics(grid(8, 8))
    assert np.allclose(statistics["dihedral"], 0, atol=1e-6)
    points = grid(8, 8).vertices
    inner = (np.abs(points[:, :2]) < 0.99).all(1)
    assert np.allclose(statistics["curvature"][inner], 0, atol=1e-9)
    assert statistics["edges"].mean() == pytest.approx(1)
    mean = (144 + 64 * np.sqrt(2)) / 208  # sides and diagonals, in cells
    assert np.ptp(statistics["edges"]) == pytest.approx((np.sqrt(2) - 1) / mean, rel=1e-5)


@pytest.mark.parametrize("radius", [0.1, 1.0, 30.0])
def test_a_sphere_has_the_curvature_of_its_radius(radius):
    ball = icosphere(24)
    mesh = ball.with_vertices(radius * ball.vertices)
    pairs = {tuple(sorted((f[k], f[k - 1]))) for f in mesh.faces.tolist() for k in range(3)}
    edge = np.mean([np.linalg.norm(mesh.vertices[a] - mesh.vertices[b]) for a, b in pairs])
    statistics = local_statistics(mesh)
    assert np.median(statistics["curvature"]) == pytest.approx(edge / radius, rel=0.02)
    assert (statistics["dihedral"] > 0).all()
    # Inside out it is concave.
    inside = local_statistics(Mesh(mesh.vertices, mesh.faces[:, ::-1]))
    assert np.allclose(inside["dihedral"], -statistics["dihedral"], atol=1e-5)
    assert np.allclose(inside["curvature"], -statistics["curvature"], atol=1e-5)


def test_a_roof():
    points = np.array([[0, 0, 1], [1, 0, 1], [0.5, -1, 0], [0.5, 1, 0]], float)
    roof = Mesh(points, np.array([[0, 2, 1], [0, 1, 3]]))
    assert local_statistics(roof)["dihedral"] == pytest.approx([np.pi / 2], abs=1e-6)


def test_distances():
    ball = icosphere(12)
    rng = np.random.default_rng(0)
    rough = ball.with_vertices(ball.vertices * (1 + rng.normal(0, 0.02, (len(ball.vertices), 1))))
    assert all(value == 0 for value in statistic_distances(ball, ball).values())
    apart = statistic_distances(rough, ball)
    assert all(value > 0.01 for value in apart.values())
    larger = rough.with_vertices(7 * rough.vertices)
    for name, value in statistic_distances(larger, rough).items():
        assert value == pytest.approx(0, abs=1e-5), name
