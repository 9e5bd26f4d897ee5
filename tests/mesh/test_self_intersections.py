"""Pairs of faces that pierce each other: known counts, and an independent count by rays."""

import numpy as np
import pytest

from mitex.mesh import Mesh, grid, icosphere, torus
from mitex.mesh.self_intersections import piercing_pairs
from mitex.scenes.crossings import crossing_edges

TRIANGLE = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0]], float)


def pair(other) -> Mesh:
    """A triangle in the plane z = 0 and another one."""
    return Mesh(np.concatenate([TRIANGLE, np.array(other, float)]), np.arange(6).reshape(2, 3))


@pytest.mark.parametrize(
    ("other", "pierces"),
    [
        ([[0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 0.5]], True),  # an edge through the inside
        ([[-1, 1, -1], [3, 1, -1], [1, 1, 3]], True),  # the other way round
        ([[0.5, 0.5, 1], [0.5, 0.5, 2], [3, 3, 1]], False),  # above
        ([[3, 3, -1], [3, 3, 1], [4, 4, 0]], False),  # across the plane, beside the triangle
        ([[0.5, 0.5, 0], [0.5, 0.5, 1], [1, 1, 1]], False),  # a vertex touches
        ([[0.5, 0, 0], [1.5, 0, 0], [1, 0, 1]], False),  # an edge touches an edge
        ([[0.5, 0.5, 0], [1, 0.5, 0], [0.5, 1, 0]], False),  # in one plane
    ],
)
def test_two_triangles(other, pierces):
    mesh = pair(other)
    assert piercing_pairs(mesh).tolist() == ([[0, 1]] if pierces else [])
    moved = mesh.with_vertices(mesh.vertices @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0])
    assert len(piercing_pairs(moved)) <= pierces  # what touched may now be apart, but does not pierce


def test_triangles_that_share_a_vertex_pierce_or_not():
    fan = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0.5, -1], [0.5, 0.5, 1], [-1, -1, 1]]
    for corners, count in (([0, 3, 4], 1), ([0, 4, 5], 0)):
        assert len(piercing_pairs(Mesh(np.array(fan, float), np.array([[0, 1, 2], corners])))) == count


def test_neighbours_of_a_surface_do_not_count():
    for mesh in (icosphere(8), torus(24, 12, tube=0.3), grid(6, 6)):
        assert len(piercing_pairs(mesh)) == 0


def test_a_sheet_that_is_folded_through_itself():
    """A strip of 4 x 1 cells, bent round so that its last cell stands in its first one.

    The last cell stands on x = 0.5, from y = 0.2 to 0.5 and z = -1 to 1, and its diagonal passes z = 0 at
    y = 0.35. The first cell's diagonal is y = x. So the line y < 0.5 lies in the first cell's lower triangle
    alone, which both upright triangles pierce.
    """
    across, ends = ([0, 0], [1, 0], [2, 1], [1, 2]), ([0.5, 1], [0.5, -1])
    bottom = [[x, 0.0, z] for x, z in across] + [[x, 0.2, z] for x, z in ends]
    top = [[x, 1.0, z] for x, z in across] + [[x, 0.5, z] for x, z in ends]
    cells = [[k, k + 1, k + 7, k + 6] for k in range(5)]
    faces = np.array([[[a, b, c], [a, c, d]] for a, b, c, d in cells]).reshape(-1, 3)
    pairs = piercing_pairs(Mesh(np.array(bottom + top), faces))
    assert pairs.tolist() == [[0, 8], [0, 9]]
    assert faces[[0, 8, 9]].tolist() == [[0, 1, 7], [4, 5, 11], [4, 11, 10]]


def test_rays_see_the_same_edges():
    """Two balls through each other: the edges of the pairs that pierce are those that rays find."""
    ball = icosphere(6)
    vertices = np.concatenate([ball.vertices, 0.8 * ball.vertices + [0.713, 0.211, 0.107]])
    mesh = Mesh(vertices, np.concatenate([ball.faces, ball.faces + len(ball.vertices)]))
    pairs = piercing_pairs(mesh)
    assert len(pairs) > 40
    assert (mesh.faces[pairs[:, 0]].max(1) < len(ball.vertices)).all()
    assert (mesh.faces[pairs[:, 1]].min(1) >= len(ball.vertices)).all()
    edges = crossing_edges(mesh)
    assert set(edges.ravel().tolist()) <= set(mesh.faces[pairs].ravel().tolist())
    assert len(edges) == pytest.approx(len(pairs), rel=0.6)


def test_one_large_face_among_small_ones():
    ball = icosphere(6)
    large = np.array([[-50, 0.013, -50], [50, 0.017, -50], [0, 0.011, 90]])
    mesh = Mesh(
        np.concatenate([ball.vertices, large]),
        np.concatenate([ball.faces, [[len(ball.vertices) + k for k in range(3)]]]),
    )
    pairs = piercing_pairs(mesh)
    heights = ball.vertices[ball.faces][..., 1]
    assert (pairs[:, 1] == len(ball.faces)).all()
    crossing = np.flatnonzero((heights.min(1) < 0) & (heights.max(1) > 0.02))
    assert set(crossing.tolist()) <= set(pairs[:, 0].tolist())
    assert len(pairs) <= ((heights.min(1) < 0.02) & (heights.max(1) > 0)).sum()


def test_pairs_with_some_faces_are_those_of_all_pairs(rng):
    """Of triangles of many sizes, thrown together."""
    corners = rng.normal(size=(300, 1, 3)) + rng.uniform(0.02, 1, (300, 1, 1)) * rng.normal(size=(300, 3, 3))
    mesh = Mesh(corners.reshape(-1, 3).astype(np.float32), np.arange(900, dtype=np.int32).reshape(-1, 3))
    pairs, faces = piercing_pairs(mesh), rng.choice(300, 40, replace=False)
    among = np.isin(pairs, faces).any(1)
    assert 0 < among.sum() < len(pairs)
    np.testing.assert_array_equal(piercing_pairs(mesh, faces), pairs[among])
    assert len(piercing_pairs(mesh, faces[:0])) == 0
