"""Carrying tangent vectors along edges, and the Laplacian made of it."""

import numpy as np

from mitex.geometry.vectors import unit
from mitex.mesh import scattered_sphere
from mitex.mesh.connection import connection_laplacian, solver, tangent_axes, transport
from mitex.mesh.topology import mesh_edges

X, Y, Z = np.eye(3)


def test_directions_keep_their_length_when_carried_or_are_dropped():
    fold = np.pi - np.array([0.0, 1e-9, 1e-5, 1e-3, 2e-3, 0.1, 3.0, np.pi])
    normals = np.concatenate([np.cos(fold)[:, None] * Z + np.sin(fold)[:, None] * unit(X + 2 * Y), Z[None]])
    edges = np.stack([np.arange(8), np.full(8, 8)], axis=1)
    length = np.abs(transport(normals, *tangent_axes(normals), edges))
    np.testing.assert_allclose(length, [0, 0, 0, 0, 1, 1, 1, 1], atol=1e-6)


def test_laplacian_is_the_sum_over_edges(rng):
    mesh = scattered_sphere(60)
    edges, _ = mesh_edges(mesh.faces, 60)
    normals = unit(mesh.normals.astype(np.float64))
    carried = transport(normals, *tangent_axes(normals), edges)
    carried[5] = 0
    weights = rng.uniform(0.5, 2.0, len(edges))
    u = rng.normal(size=60) + 1j * rng.normal(size=60)
    energy = 0.0
    for (i, j), r, w in zip(edges, carried, weights, strict=True):
        energy += w * abs(u[i] - r * u[j]) ** 2 if r else 0.0
    laplacian = connection_laplacian(edges, carried, weights, 60)
    np.testing.assert_allclose(np.vdot(u, laplacian @ u), energy, rtol=1e-12)
    np.testing.assert_allclose(laplacian @ solver(laplacian)(u), u, atol=1e-9)
