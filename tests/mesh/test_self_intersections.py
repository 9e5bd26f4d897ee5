"""Pairs of faces that pierce each other: known counts, and all edges against all faces."""

import numpy as np
import pytest

from mitex.mesh import Mesh, grid, icosphere, torus
from mitex.mesh.self_intersections import piercing_pairs

TRIANGLE = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0]], float)


def pair(other) -> Mesh:
    """A triangle in the plane z = 0 and another one."""
    return Mesh(np.concatenate([TRIANGLE, np.array(other, float)]), np.arange(6).reshape(2, 3))


@pytest.mark.parametrize(
    ("other", "pierces"),
    [
        ([[0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 0.5]], True),  # an edge through the inside
        ([[0.5, 0.5, -1], [0.5, 0.5, 1], [0.6, 0.6, 3]], True),  # two edges
        ([[-1, 1, -1], [3, 1, -1], [1, 1, 3]], True),  # the other way round
        ([[1, -1, -1], [1, 1, -1], [1, 0, 1]], True),  # an edge of each through the other's inside
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


@pytest.mark.parametrize("mesh", [icosphere(8), torus(24, 12, tube=0.3), torus(), grid(6, 6)])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_neighbours_of_a_surface_do_not_count(mesh, size):
    assert len(piercing_pairs(mesh.with_vertices(mesh.vertices * size))) == 0


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


@pytest.mark.parametrize(("size", "shift"), [(1.0, [0.9, 0.17, 0.31]), (0.8, [0.713, 0.211, 0.107])])
def test_two_balls_pierce_along_a_circle(size, shift):
    ball = icosphere(4)
    vertices = np.concatenate([ball.vertices, size * ball.vertices + shift])
    mesh = Mesh(vertices, np.concatenate([ball.faces, ball.faces + len(ball.vertices)]))
    pairs = piercing_pairs(mesh)
    assert len(pairs) > 40
    assert (mesh.faces[pairs[:, 0]].max(1) < len(ball.vertices)).all()
    assert (mesh.faces[pairs[:, 1]].min(1) >= len(ball.vertices)).all()
    assert {tuple(pair) for pair in pairs.tolist()} == brute_force(mesh)


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


@pytest.fixture
def soup(rng) -> Mesh:
    """Triangles of many sizes, thrown together."""
    corners = rng.normal(size=(300, 1, 3)) + rng.uniform(0.02, 1, (300, 1, 1)) * rng.normal(size=(300, 3, 3))
    return Mesh(corners.reshape(-1, 3).astype(np.float32), np.arange(900, dtype=np.int32).reshape(-1, 3))


def test_triangles_of_many_sizes(soup):
    assert {tuple(pair) for pair in piercing_pairs(soup).tolist()} == brute_force(soup)


def test_pairs_with_some_faces_are_those_of_all_pairs(rng, soup):
    pairs, faces = piercing_pairs(soup), rng.choice(300, 40, replace=False)
    among = np.isin(pairs, faces).any(1)
    assert 0 < among.sum() < len(pairs)
    np.testing.assert_array_equal(piercing_pairs(soup, faces), pairs[among])
    assert len(piercing_pairs(soup, faces[:0])) == 0


def brute_force(mesh: Mesh) -> set[tuple[int, int]]:
    """By solving start + t way = a + u (b - a) + v (c - a) for every edge and face."""
    pairs = set()
    corners = mesh.vertices[mesh.faces].astype(float)
    a, b, c = corners.swapaxes(0, 1)
    for one, face in enumerate(corners):
        for k in range(3):
            apart = ~np.isin(mesh.faces, mesh.faces[one, [k, k - 1]]).any(1)
            way = np.broadcast_to(face[k - 1] - face[k], a.shape)
            matrix = np.stack([-way, b - a, c - a], 2)
            others = np.flatnonzero(apart & (np.abs(np.linalg.det(matrix)) >= 1e-12))
            t, u, v = np.linalg.solve(matrix[others], (face[k] - a[others])[..., None])[..., 0].T
            inside = (t > 0) & (t < 1) & (u > 0) & (v > 0) & (u + v < 1)
            pairs |= {(min(one, other), max(one, other)) for other in others[inside].tolist()}
    return pairs
