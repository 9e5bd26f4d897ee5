"""Triangles against formulas and dense sampling."""

import numpy as np
import pytest

from mitex.geometry.triangles import (
    barycentric_gradients,
    interpolate,
    nearest_on_border,
    nearest_on_triangles,
    scattered,
    triangle_crosses,
    twice_area,
)


def test_areas(rng):
    flat = rng.normal(size=(30, 3, 2))
    crosses = triangle_crosses(np.pad(flat, ((0, 0), (0, 0), (0, 1))))
    np.testing.assert_allclose(crosses[:, 2], twice_area(flat))
    assert not crosses[:, :2].any()
    a, b, c = (np.linalg.norm(flat[:, k] - flat[:, k - 1], axis=1) for k in range(3))
    half = 0.5 * (a + b + c)
    heron = np.sqrt(half * (half - a) * (half - b) * (half - c))
    np.testing.assert_allclose(np.abs(twice_area(flat)), 2 * heron, rtol=1e-6)


def test_scattered_points_are_uniform(rng):
    """Over triangles by their areas, and over each of them: a quarter in the one between the middles."""
    face, weights = scattered(np.array([1.0, 0.0, 3.0]), rng.random((3, 40_000)))
    np.testing.assert_allclose(np.bincount(face) / 40_000, [0.25, 0, 0.75], atol=0.01)
    np.testing.assert_allclose(weights.sum(1), 1)
    assert weights.min() >= 0 and (weights < 0.5).all(1).mean() == pytest.approx(0.25, abs=0.01)
    np.testing.assert_allclose((weights > 0.5).mean(0), 0.25, atol=0.01)
    last, _ = scattered(np.ones(3), np.array([[np.nextafter(1, 0)], [0.5], [0.5]]))
    assert last == 2


def test_gradients_give_the_weights_that_interpolate_the_point(rng):
    p = rng.normal(size=(30, 3, 2))
    points = rng.normal(size=(30, 2))
    origin, gradient = barycentric_gradients(p, twice_area(p))
    b = interpolate(points - origin, gradient.reshape(-1, 2, 2).transpose(0, 2, 1))
    weights = np.column_stack([1 - b.sum(1), b])
    np.testing.assert_allclose(interpolate(weights, p), points, atol=1e-9)


def test_nearest_points_of_the_border_against_dense_samples(rng):
    triangles, points = rng.normal(size=(30, 3, 2)), 2 * rng.normal(size=(30, 2))
    barycentric, distance = nearest_on_border(triangles, points)
    np.testing.assert_allclose(barycentric.sum(1), 1.0)
    assert (barycentric.min(1) == 0.0).all()
    border_points = interpolate(barycentric, triangles)
    np.testing.assert_allclose(np.linalg.norm(border_points - points, axis=1), distance, atol=1e-12)
    t = np.linspace(0, 1, 2001)[:, None]
    for triangle, point, value in zip(triangles, points, distance, strict=True):
        sides = np.concatenate([(1 - t) * triangle[k] + t * triangle[k - 1] for k in range(3)])
        nearest = np.linalg.norm(sides - point, axis=1).min()
        assert value <= nearest < value + 1e-3


def test_sides_without_length_are_points():
    triangle = np.zeros((1, 3, 2), np.float32)
    barycentric, distance = nearest_on_border(triangle, np.array([[3.0, 4.0]], np.float32))
    assert distance[0] == 5.0 and np.isfinite(barycentric).all()


def _dense(triangle, count=60):
    """Points all over a triangle, (N, 3), and their greatest distance from each other's neighbours."""
    i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
    inside = i + j <= count
    weights = np.stack([i, j, count - i - j], -1)[inside] / count
    return weights @ triangle, np.linalg.norm(triangle - np.roll(triangle, 1, axis=0), axis=1).max() / count


def test_nearest_points_of_triangles_against_dense_samples(rng):
    """Points above, beside and below triangles in space."""
    triangles, points = rng.normal(size=(60, 3, 3)), 1.5 * rng.normal(size=(60, 3))
    barycentric, distance = nearest_on_triangles(triangles, points)
    np.testing.assert_allclose(barycentric.sum(1), 1.0)
    assert barycentric.min() >= 0.0
    inside = (barycentric > 0).sum(1)
    assert all((inside == count).any() for count in (1, 2, 3))  # corners, sides, and faces
    nearest = interpolate(barycentric, triangles)
    np.testing.assert_allclose(np.linalg.norm(nearest - points, axis=1), distance, atol=1e-12)
    for triangle, point, value in zip(triangles, points, distance, strict=True):
        samples, step = _dense(triangle)
        least = np.linalg.norm(samples - point, axis=1).min()
        assert value <= least + 1e-12 and least < value + step


def test_the_point_of_a_triangle_nearest_to_one_of_its_own(rng):
    triangles, weights = rng.normal(size=(40, 3, 3)), rng.dirichlet(np.ones(3), 40)
    points = interpolate(weights, triangles)
    barycentric, distance = nearest_on_triangles(triangles, points)
    np.testing.assert_allclose(barycentric, weights, atol=1e-9)
    assert distance.max() < 1e-12


def test_triangles_without_area_are_segments_or_points():
    line = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]])
    triangles = np.stack([line, line, np.zeros((3, 3))])
    points = np.array([[2.0, 4, 0], [5.0, 0, 0], [0.0, 3, 4]])
    barycentric, distance = nearest_on_triangles(triangles, points)
    assert np.isfinite(barycentric).all()
    np.testing.assert_allclose(distance, [4, 2, 5])
    np.testing.assert_allclose(interpolate(barycentric, triangles), [[2, 0, 0], [3, 0, 0], [0, 0, 0]])
