"""Polygons to triangles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitex.errors import MeshError
from mitex.mesh.polygons import triangulate


def cut(points, sizes=None):
    points = np.array([[*p, 0.0] if len(p) == 2 else p for p in points], float)
    sizes = np.array([len(points)] if sizes is None else sizes)
    return points, triangulate(points, np.arange(sizes.sum()), sizes)


def signed_areas(points, triangles):
    a, b, c = (points[triangles[:, k], :2] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def test_order_of_mixed_polygons_is_kept():
    corners = [(0, 0), (1, 0), (0, 1)] + [(0, 0), (1, 0), (1, 1), (0, 1)] + [(2, 0), (3, 0), (2, 1)]
    _, triangles = cut(corners, [3, 4, 3])
    assert triangles.tolist() == [[0, 1, 2], [3, 4, 5], [3, 5, 6], [7, 8, 9]]


def test_small_polygons_give_nothing():
    _, triangles = cut([(0, 0), (1, 0), (0, 0), (1, 0), (0, 1), (5, 5)], [2, 3, 1, 0])
    assert triangles.tolist() == [[2, 3, 4]]


def test_quad_is_cut_along_its_shorter_diagonal():
    assert cut([(0, 0), (3, -1), (4, 0), (3, 1)])[1].tolist() == [[0, 1, 3], [1, 2, 3]]
    assert cut([(0, 0), (1, -3), (2, 0), (1, 3)])[1].tolist() == [[0, 1, 2], [0, 2, 3]]


def test_concave_quad_is_cut_inside():
    # The shorter diagonal, from corner 1 to corner 3, lies outside.
    points, triangles = cut([(0, 0), (4, 4), (0.5, 2), (-4, 4)])
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert (signed_areas(points, triangles) > 0.0).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("turned", [False, True])
def test_concave_polygon_in_any_plane(axis, turned):
    outline = [(0, 0), (4, 0), (4, 3), (3, 3), (3, 1), (1, 1), (1, 3), (0, 3)]  # a U of area 8
    flat = np.array([[x, y, 0.0] for x, y in outline])
    points = np.roll(flat[::-1] if turned else flat, axis, axis=1)
    triangles = triangulate(points, np.arange(8), np.array([8]))
    a, b, c = (points[triangles[:, k]] for k in range(3))
    areas = 0.5 * np.cross(b - a, c - a)[:, (2 + axis) % 3] * (-1.0 if turned else 1.0)
    assert len(triangles) == 6
    assert (areas > 0.0).all()
    assert areas.sum() == pytest.approx(8.0)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(0.2, 1.0), min_size=5, max_size=24))
def test_star_polygons_are_covered_once(radii):
    angle = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    outline = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.array(radii)[:, None]
    x, y = outline.T
    area = 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
    points, triangles = cut(outline.tolist())
    areas = signed_areas(points, triangles)
    assert len(triangles) == len(radii) - 2
    assert areas.min() > -1e-12
    assert areas.sum() == pytest.approx(area)


def test_a_polygon_that_crosses_itself_still_ends():
    _, triangles = cut([(0, 0), (1, 1), (1, 0), (0, 1), (0.5, -1)])
    assert len(triangles) == 3


def test_too_many_corners():
    with pytest.raises(MeshError, match="2001 corners"):
        triangulate(np.zeros((2001, 3)), np.arange(2001), np.array([2001]))
