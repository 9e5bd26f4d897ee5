"""Low-pass filters on meshes, beside the closed form on a sphere."""

import numpy as np
import pytest
from numpy.polynomial import Legendre

from mitex.mesh import Mesh, icosphere
from mitex.mesh.low_pass import blurred, low_pass

BALL = icosphere(24)


@pytest.mark.parametrize("degree", [1, 4, 9, 16])
@pytest.mark.parametrize("width", [0.05, 0.2])
def test_spherical_harmonics_are_multiplied(degree, width):
    """Those of degree n are waves of the wavenumber sqrt(n (n + 1))."""
    wave = Legendre.basis(degree)(BALL.vertices[:, 1].astype(np.float64))
    filtered = low_pass(BALL, width)(wave)
    x = 0.5 * width**2 * degree * (degree + 1)
    kept = (filtered * wave).sum() / (wave * wave).sum()
    assert kept == pytest.approx(1 / (1 + x**2), abs=0.01)
    assert np.abs(filtered - kept * wave).max() < 0.02


def test_the_filter_follows_the_size_of_the_mesh_and_takes_vectors():
    values = np.random.default_rng(0).normal(size=(len(BALL.vertices), 3))
    one = low_pass(BALL, 0.1)(values)
    assert np.allclose(low_pass(BALL.with_vertices(7 * BALL.vertices + 3), 0.7)(values), one, atol=1e-5)
    assert np.allclose(low_pass(BALL, 0.1)(values[:, 1]), one[:, 1])


def test_vertices_without_faces_keep_what_they_have():
    mesh = Mesh(np.concatenate([BALL.vertices, [[9, 9, 9]]]), BALL.faces)
    assert blurred(mesh, 0.2).vertices[-1] == pytest.approx(9 * np.ones(3), rel=0.01)


def test_blurred_meshes_lose_their_relief_and_keep_their_size():
    rough = BALL.with_vertices(BALL.vertices * (1 + 0.05 * np.cos(24 * BALL.vertices[:, 1:2])))
    assert blurred(rough, 0) is rough
    before, after = (np.linalg.norm(mesh.vertices, axis=1) for mesh in (rough, blurred(rough, 0.2)))
    assert after.std() < 0.3 * before.std()
    assert after.mean() == pytest.approx(before.mean(), rel=0.01)
