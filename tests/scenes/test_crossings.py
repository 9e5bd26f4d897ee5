"""Edges that pierce faces of their own mesh."""

import numpy as np
import pytest

from mitex.mesh import Mesh, grid, icosphere, torus
from mitex.scenes.crossings import crossing_edges


@pytest.mark.parametrize("mesh", [icosphere(8), torus(), grid(5, 5)])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_simple_surfaces_have_none(mesh, size):
    assert not len(crossing_edges(mesh.with_vertices(mesh.vertices * size)))


def test_an_edge_through_a_face():
    points = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [1, 1, 1], [1.2, 1.2, 3]]
    mesh = Mesh(np.array(points, float), np.array([[0, 1, 2], [3, 4, 5]]))
    assert crossing_edges(mesh).tolist() == [[3, 4], [3, 5]]


def test_two_spheres_cross_along_a_circle():
    """As many edges of either as a brute-force test of all edges against all faces finds."""
    ball = icosphere(3)
    points = np.concatenate([ball.vertices, ball.vertices + [0.9, 0.17, 0.31]])
    mesh = Mesh(points, np.concatenate([ball.faces, ball.faces + len(ball.vertices)]))
    edges = {tuple(pair) for pair in crossing_edges(mesh).tolist()}
    assert edges == brute_force(mesh) and len(edges) > 20


def test_a_crossing_behind_a_face_that_is_touched():
    """The first edge runs in the plane of its own face, and pierces another further on."""
    points = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, -1, -1], [1, 1, -1], [1, 0, 1]]
    mesh = Mesh(np.array(points, float), np.array([[0, 1, 2], [3, 4, 5]]))
    assert crossing_edges(mesh).tolist() == [[0, 1], [4, 5]]


def brute_force(mesh: Mesh) -> set[tuple[int, int]]:
    """By solving start + t way = a + u (b - a) + v (c - a) for every edge and face."""
    corners = mesh.vertices[mesh.faces].astype(float)
    sides = {tuple(sorted((int(f[k]), int(f[k - 1])))) for f in mesh.faces for k in range(3)}
    edges = set()
    for i, j in sides:
        start, way = mesh.vertices[i].astype(float), (mesh.vertices[j] - mesh.vertices[i]).astype(float)
        for face, (a, b, c) in zip(mesh.faces, corners, strict=True):
            if i in face or j in face:
                continue
            matrix = np.stack([-way, b - a, c - a], 1)
            if abs(np.linalg.det(matrix)) < 1e-12:
                continue
            t, u, v = np.linalg.solve(matrix, start - a)
            if 0 < t < 1 and u > 0 and v > 0 and u + v < 1:
                edges.add((i, j))
    return edges
