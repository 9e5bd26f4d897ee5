"""Components, boundary, non-manifold edges, Euler characteristic."""

import numpy as np
import pytest
from hypothesis import given, settings

from mitex.mesh import grid, icosphere, torus
from mitex.mesh.topology import (
    boundary_edges,
    boundary_loops,
    components,
    euler_characteristic,
    face_edges,
    mesh_edges,
    non_manifold_edges,
    opposed_edges,
    paired_sides,
)
from tests.mesh.examples import FAN, OCTAHEDRON, meshes


@settings(max_examples=60, deadline=None)
@given(meshes())
def test_edge_lists_equal_brute_force(mesh):
    sides, numbers = {}, {}
    for f, face in enumerate(mesh.faces.tolist()):
        for k, (a, b) in enumerate(zip(face, face[1:] + face[:1], strict=True)):
            sides.setdefault((min(a, b), max(a, b)), []).append(a < b)
            numbers.setdefault((min(a, b), max(a, b)), []).append(3 * f + k)
    expected = sorted(sides)
    count = len(mesh.vertices)
    pairs, counts = mesh_edges(mesh.faces, count)
    assert [tuple(p) for p in pairs.tolist()] == expected
    assert counts.tolist() == [len(sides[p]) for p in expected]
    same_pairs, index = face_edges(mesh.faces, count)
    np.testing.assert_array_equal(same_pairs, pairs)
    np.testing.assert_array_equal(np.sort(pairs[index], axis=2), np.sort(np.stack(
        [mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2), axis=2))  # fmt: skip
    assert {tuple(p) for p in boundary_edges(mesh.faces, count).tolist()} == {
        p for p in expected if len(sides[p]) == 1
    }
    assert {tuple(p) for p in non_manifold_edges(mesh.faces, count).tolist()} == {
        p for p in expected if len(sides[p]) > 2
    }
    twos = [numbers[p] for p in expected if len(sides[p]) == 2]
    np.testing.assert_array_equal(paired_sides(mesh.faces, count), np.reshape(twos, (-1, 2)))
    assert opposed_edges(mesh.faces, count) == sum(len(s) == 2 and s[0] == s[1] for s in sides.values())


@settings(max_examples=40, deadline=None)
@given(meshes())
def test_components_equal_flooding(mesh):
    count, label = components(mesh.edges)
    graph = mesh.edges
    reference = -np.ones(len(mesh.vertices), int)
    number = 0
    for start in range(len(reference)):
        if reference[start] >= 0:
            continue
        queue = [start]
        while queue:
            i = queue.pop()
            if reference[i] < 0:
                reference[i] = number
                queue += graph.indices[graph.indptr[i] : graph.indptr[i + 1]].tolist()
        number += 1
    assert count == number
    assert len(set(zip(label.tolist(), reference.tolist(), strict=True))) == number


@pytest.mark.parametrize(
    ("mesh", "euler", "loops", "boundary"),
    [(icosphere(3), 2, 0, 0), (torus(8, 5), 0, 0, 0), (grid(4, 3), 1, 1, 14)],
)
def test_known_shapes(mesh, euler, loops, boundary):
    count = len(mesh.vertices)
    assert euler_characteristic(mesh.faces, count) == euler
    assert boundary_loops(mesh.faces, count) == loops
    assert len(boundary_edges(mesh.faces, count)) == boundary
    assert opposed_edges(mesh.faces, count) == 0


def test_boundary_loops_of_a_tube():
    assert boundary_loops(np.concatenate([OCTAHEDRON[:3], OCTAHEDRON[4:7]]), 6) == 1
    assert boundary_loops(np.delete(OCTAHEDRON, [0, 6], axis=0), 6) == 2


def test_a_flipped_face_is_opposed_to_its_neighbours():
    flipped = FAN.copy()
    flipped[0] = flipped[0, ::-1]
    assert opposed_edges(FAN, 4) == 0
    assert opposed_edges(flipped, 4) == 2
