"""Nearest vertices by lists, against all distances."""

from types import SimpleNamespace

import numpy as np
import pytest

from mitex.mesh import icosphere
from mitex.methods.nerf.field import nearest
from mitex.methods.nerf.field.nearest import FAR, UNLISTED, Growing, NearestVertices


@pytest.fixture(autouse=True)
def _mitsuba(mi) -> None:
    """Dr.Jit with a variant."""


def uneven(rng: np.random.Generator) -> np.ndarray:
    """A thousand vertices on an ellipsoid, irregularly."""
    vertices = icosphere(10).vertices * (1.0, 0.6, 0.4)
    return (vertices + rng.normal(size=vertices.shape) * 0.01).astype(np.float32)


def brute(vertices: np.ndarray, points: np.ndarray, count: int) -> np.ndarray:
    """(N, K) by all distances."""
    distance = np.linalg.norm(points[:, None].astype(np.float64) - vertices, axis=2)
    return np.argsort(distance, axis=1)[:, :count]


@pytest.mark.parametrize("count", [3, 5, 8])
def test_lists_give_the_nearest_in_order(rng, count):
    vertices = uneven(rng)
    points = rng.uniform(-1, 1, (2000, 3)).astype(np.float32) * (1.0, 0.7, 0.5)
    points = points.astype(np.float32)
    near = NearestVertices(vertices, count, 0.1)
    points_near, index = near(points)
    np.testing.assert_array_equal(points_near, np.arange(2000))
    assert (near._slots(points) >= 0).mean() > 0.7
    same = (index == brute(vertices, points, count)).all(axis=1)
    assert same.mean() > 0.995
    distance, best = (
        np.linalg.norm(points - vertices[i[:, -1]], axis=1) for i in (index, brute(vertices, points, count))
    )
    np.testing.assert_allclose(distance, best, atol=0.02)


def test_asking_again_changes_nothing(rng):
    near = NearestVertices(uneven(rng), 8, 0.1)
    points = rng.uniform(-0.8, 0.8, (500, 3)).astype(np.float32)
    first = near(points)[1]
    near(points[::-1] * np.float32(1.1))
    np.testing.assert_array_equal(near(points)[1], first)


def test_places_are_listed_one_by_one_as_at_once(rng, monkeypatch):
    """Cells that are listed later share corners with those before, which are looked up once."""
    vertices, points = uneven(rng), rng.uniform(-0.8, 0.8, (200, 3)).astype(np.float32)
    at_once, slowly = (NearestVertices(vertices, 8, 0.1) for _ in range(2))
    corners, query = [], slowly._tree.query

    def counted(places, **options):
        corners.extend(map(tuple, places))
        return query(places, **options)

    monkeypatch.setattr(slowly, "_tree", SimpleNamespace(query=counted))
    expected = at_once(points)[1]
    np.testing.assert_array_equal([slowly(point[None])[1][0] for point in points], expected)
    assert (slowly._slots(points) >= 0).sum() > 150 and len(set(corners)) == len(corners) > 200


@pytest.mark.parametrize("sizes", [(1, 0, 40, 3), (100, 1, 1)])
def test_numbers_grow_at_their_end(rng, sizes):
    parts = [rng.integers(0, 1000, size).astype(np.uint32) for size in sizes]
    growing = Growing()
    for part in parts:
        growing.append(part)
    together = np.concatenate(parts)
    assert len(growing) == len(together)
    np.testing.assert_array_equal(np.array(growing.values)[: len(together)], together)


def test_any_spacing_is_right(rng):
    vertices = uneven(rng)
    points = (vertices[:300] * 1.1).astype(np.float32)
    expected = brute(vertices, points, 5)
    for spacing in (1e-4, 0.02, 10.0):
        index = NearestVertices(vertices, 5, spacing)(points)[1]
        assert (index == expected).all(axis=1).mean() > 0.99


def test_points_without_a_list_are_looked_up_in_the_tree(rng, monkeypatch):
    monkeypatch.setattr(nearest, "CELLS", 20)
    vertices = uneven(rng)
    near = NearestVertices(vertices, 8, 0.1)
    points = rng.uniform(-2, 2, (1000, 3)).astype(np.float32)
    points_near, index = near(points)
    slots = near._slots(points)
    assert slots.max() == 19 and (slots == UNLISTED).mean() > 0.9
    np.testing.assert_array_equal(points_near, np.arange(1000))
    assert (index == brute(vertices, points, 8)).all(axis=1).mean() > 0.995


def test_only_points_beyond_the_limit_are_left_out(rng):
    vertices = uneven(rng)
    points = rng.uniform(-3, 3, (5000, 3)).astype(np.float32)
    near = NearestVertices(vertices, 8, 0.1, limit=0.3)
    points_near, index = near(points)
    distance = np.linalg.norm(points[:, None] - vertices, axis=2).min(axis=1)
    assert set(np.flatnonzero(distance < 0.3)) <= set(points_near)
    assert distance[points_near].max() < 0.3 + 2 * np.sqrt(3) * 0.15
    assert (near._slots(points) == FAR).any() and (near._slots(points) == UNLISTED).any()
    assert (index == brute(vertices, points[points_near], 8)).all(axis=1).mean() > 0.995


def test_few_vertices_and_no_points():
    triangle = np.eye(3, dtype=np.float32)
    points = np.array([[0.9, 0.2, 0.1]], np.float32)
    np.testing.assert_array_equal(NearestVertices(triangle, 3, 1.0)(points)[1], [[0, 1, 2]])
    points_near, index = NearestVertices(triangle, 2, 1.0)(np.zeros((0, 3), np.float32))
    assert points_near.shape == (0,) and index.shape == (0, 2)
