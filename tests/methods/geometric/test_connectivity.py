"""Which faces meet."""

import numpy as np
import pytest

from mitex.mesh import grid, icosphere, torus
from mitex.methods.geometric.connectivity import FaceGraph


def test_two_faces():
    graph = FaceGraph.of(np.array([[0, 1, 2], [2, 1, 3]]), 4)
    assert graph.open.tolist() == [[True, False, True], [False, True, True]]
    assert graph.neighbours.tolist() == [[0, 1, 0], [0, 1, 1]]
    assert graph.opposite.tolist() == [[2, 3, 1], [0, 2, 1]]
    assert graph.incident.tolist() == [1, 2, 2, 1]


@pytest.mark.parametrize("mesh", [icosphere(3), torus(8, 5)])
def test_closed_meshes_have_three_neighbours_everywhere(mesh):
    graph = FaceGraph.of(mesh.faces, len(mesh.vertices))
    assert not graph.open.any()
    corners = graph.faces[graph.neighbours].numpy()
    for k in range(3):
        side = {0: (0, 1), 1: (1, 2), 2: (2, 0)}[k]
        shared = [
            set(a[list(side)]) == set(b) - {o}
            for a, b, o in zip(mesh.faces, corners[:, k], graph.opposite[:, k].tolist(), strict=True)
        ]
        assert all(shared)


def test_the_boundary_is_open():
    mesh = grid(4, 3)
    graph = FaceGraph.of(mesh.faces, len(mesh.vertices))
    assert int(graph.open.sum()) == 2 * (4 + 3)
    own = np.arange(len(mesh.faces))[:, None].repeat(3, 1)
    assert np.array_equal(graph.neighbours.numpy()[graph.open], own[graph.open])


def test_sides_of_three_faces_and_of_disagreeing_windings_are_open():
    fan = FaceGraph.of(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]), 5)
    assert fan.open.all()
    twisted = FaceGraph.of(np.array([[0, 1, 2], [1, 2, 3]]), 4)
    assert twisted.open.all()


def test_two_triangles_back_to_back():
    graph = FaceGraph.of(np.array([[0, 1, 2], [0, 2, 1]]), 3)
    assert not graph.open.any() and graph.neighbours.tolist() == [[1] * 3, [0] * 3]
    assert graph.opposite.tolist() == [[2, 0, 1], [1, 0, 2]]
