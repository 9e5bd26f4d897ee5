"""Polygons to triangles, and back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitex.errors import MeshError
from mitex.mesh.polygons import Polygons, outlines, triangulate


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


MIXED = Polygons(
    np.array([3, 4, 5]), np.array([[0, 1, 2], [3, 4, 5], [3, 5, 6], [7, 8, 9], [7, 9, 11], [9, 10, 11]])
)


@pytest.mark.parametrize(
    ("sizes", "triangles", "vertices", "words"),
    [
        ([4], [[0, 1, 2]], None, "do not fit"),
        ([2, 3], [[0, 1, 2]], None, "do not fit"),
        ([[3]], [[0, 1, 2]], None, "do not fit"),
        ([3], [[0, 1, 2, 3]], None, "do not fit"),
        ([3, 3], [[0, 1, 2], [2, 3, 4]], None, "corners of another polygon"),
        ([3], [[-1, 0, 1]], None, "corners of another polygon"),
        ([4], [[0, 1, 2], [0, 1, 2]], None, "no triangle has"),
        ([3], [[0, 1, 2]], [0, 1], "vertices of shape (2,)"),
    ],
)
def test_arrays_that_do_not_fit(sizes, triangles, vertices, words):
    with pytest.raises(MeshError) as error:
        Polygons(np.array(sizes), np.array(triangles), None if vertices is None else np.array(vertices))
    assert words in error.value.problem and error.value.remedy


def test_values_go_to_the_corners_and_back():
    values = np.random.default_rng(0).random((12, 2))
    corners = values[MIXED.triangles]
    np.testing.assert_array_equal(MIXED.at_corners(corners), values)
    assert MIXED.agreeing(corners).all()
    corners[3, 1] += 1.0  # a corner of this triangle alone
    assert MIXED.agreeing(corners).all()
    corners[3, 2] += 1.0  # corner 9 is in three triangles
    assert not MIXED.agreeing(corners)[3]


def test_what_is_left_of_polygons():
    drop = np.array([True, False, False, False, False, False])
    rest = MIXED.without(drop)
    assert rest.sizes.tolist() == [4, 5]
    assert rest.triangles.tolist() == (MIXED.triangles[1:] - 3).tolist()
    rest = MIXED.without(np.array([False, False, True, False, False, False]))
    assert rest.sizes.tolist() == [3, 3, 5]
    assert rest.triangles.tolist() == [[0, 1, 2], [3, 4, 5], *(MIXED.triangles[3:] - 1).tolist()]
    vertices = np.arange(12) * 10
    cut = replace(MIXED, vertices=vertices).without(np.zeros(6, bool), ~np.array([1, 1, 1, 1, 0, 1], bool))
    assert cut.sizes.tolist() == [3, 4, 3, 3, 3]
    assert cut.vertices is not None
    np.testing.assert_array_equal(cut.vertices[cut.triangles], vertices[MIXED.triangles])


def test_outlines_without_polygons_are_the_triangles():
    values = np.arange(12).reshape(2, 3, 2)
    sizes, (corners,) = outlines(None, [values])
    assert sizes.tolist() == [3, 3]
    np.testing.assert_array_equal(corners, values.reshape(6, 2))
