"""Cotangent weights against finite elements, triangle by triangle."""

import numpy as np
import pytest

from mitex.mesh import Mesh, scattered_sphere
from mitex.mesh.cotangents import cotangent_weights, vertex_areas


def test_energy_is_that_of_the_linear_interpolants(rng):
    mesh = scattered_sphere(80)
    values, energy = rng.normal(size=80), 0.0
    for face in mesh.faces:
        p, q, r = mesh.vertices[face].astype(np.float64)
        frame = np.stack([q - p, r - p])
        slopes = values[face[1:]] - values[face[0]]
        gradient = np.linalg.pinv(frame) @ slopes
        energy += 0.5 * np.linalg.norm(np.cross(*frame)) * gradient @ gradient
    pairs, weights = cotangent_weights(mesh)
    steps = values[pairs[:, 0]] - values[pairs[:, 1]]
    np.testing.assert_allclose((weights * steps**2).sum(), energy, rtol=1e-9)


def test_weights_do_not_depend_on_size():
    mesh = scattered_sphere(40)
    small = mesh.with_vertices(1e-9 * mesh.vertices)
    np.testing.assert_allclose(cotangent_weights(small)[1], cotangent_weights(mesh)[1], rtol=1e-4)


def test_areas_share_out_the_whole():
    """One triangle gives its corners a third each; vertices without faces have none."""
    corner = Mesh(np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [9, 9, 9]]), np.array([[0, 1, 2]]))
    np.testing.assert_allclose(vertex_areas(corner), [1, 1, 1, 0])
    mesh = scattered_sphere(80)
    assert vertex_areas(mesh).sum() == pytest.approx(mesh.face_areas.sum(dtype=np.float64))
