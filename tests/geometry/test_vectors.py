"""Vectors against SciPy, loops and what must not change."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mitex.geometry.vectors import (
    across,
    cross_2d,
    dot,
    orthonormal,
    rotate_about,
    scatter_add,
    unit,
    unit_normals,
)


@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_unit_vectors_of_any_size(rng, size):
    v = rng.normal(size=(50, 3))
    np.testing.assert_allclose(unit(size * v), v / np.sqrt((v**2).sum(1, keepdims=True)), rtol=1e-12)
    np.testing.assert_allclose(unit_normals(size * v), unit(v), rtol=1e-12)


def test_zero_has_no_direction():
    zero = np.zeros((2, 3), np.float32)
    assert not unit(zero).any()
    assert np.array_equal(unit_normals(zero), [[0, 0, 1], [0, 0, 1]])
    assert unit_normals(zero).dtype == np.float32


def test_products(rng):
    a, b = rng.normal(size=(2, 20, 3))
    np.testing.assert_allclose(dot(a, b), [p @ q for p, q in zip(a, b, strict=True)])
    flat = np.pad(a[:, :2], ((0, 0), (0, 1))), np.pad(b[:, :2], ((0, 0), (0, 1)))
    np.testing.assert_allclose(cross_2d(a[:, :2], b[:, :2]), np.cross(*flat)[:, 2])


def test_a_vector_is_its_part_across_and_its_part_along(rng):
    v, normals = rng.normal(size=(20, 3)), unit(rng.normal(size=(20, 3)))
    part = across(v, normals)
    np.testing.assert_allclose(dot(part, normals), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.cross(v - part, normals), 0.0, atol=1e-12)


def test_orthonormal_survives_parallel_and_zero_tangents(rng):
    normals = unit(rng.normal(size=(20, 3)))
    for tangents in (normals.copy(), np.zeros_like(normals)):
        t = orthonormal(tangents, normals)
        np.testing.assert_allclose((t * normals).sum(axis=1), 0.0, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(t, axis=1), 1.0, atol=1e-6)


@pytest.mark.parametrize("angle", [0.8, "each"])
def test_rotations_are_those_of_scipy(rng, angle):
    v, axes = rng.normal(size=(20, 3)), unit(rng.normal(size=(20, 3)))
    angle = rng.uniform(-4, 4, 20) if angle == "each" else angle
    expected = Rotation.from_rotvec(axes * np.broadcast_to(angle, 20)[:, None]).apply(v)
    np.testing.assert_allclose(rotate_about(v, axes, angle), expected, atol=1e-12)


def test_sums_over_rows_of_equal_index(rng):
    index, rows = rng.integers(0, 5, 40), rng.normal(size=(40, 2))
    expected = np.zeros((7, 2))
    for i, row in zip(index, rows, strict=True):
        expected[i] += row
    np.testing.assert_allclose(scatter_add(index, rows, 7), expected)
