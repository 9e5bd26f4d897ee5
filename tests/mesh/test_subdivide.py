"""Loop and midpoint subdivision."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from mitex.errors import MeshError
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh, grid, icosphere, quality, subdivide_loop, subdivide_midpoint, torus
from mitex.mesh.polygons import Polygons
from mitex.mesh.subdivide import child_points
from mitex.mesh.topology import mesh_edges
from tests.mesh.examples import FAN, FAN_POINTS, meshes, octahedron


def slow_loop(mesh: Mesh) -> np.ndarray:
    """Loop's rules vertex by vertex and edge by edge."""
    points = [np.array(p, float) for p in mesh.vertices]
    around: dict[tuple[int, int], list[int]] = {}
    for face in mesh.faces.tolist():
        for k in range(3):
            a, b, c = face[k], face[(k + 1) % 3], face[(k + 2) % 3]
            around.setdefault((min(a, b), max(a, b)), []).append(c)
    old = []
    for i, p in enumerate(points):
        neighbours = [a + b - i for a, b in around if i in (a, b)]
        creases = [a + b - i for (a, b), c in around.items() if i in (a, b) and len(c) != 2]
        if not neighbours:
            old.append(p)
        elif not creases:
            n = len(neighbours)
            beta = (5 / 8 - (3 / 8 + math.cos(2 * math.pi / n) / 4) ** 2) / n
            old.append((1 - n * beta) * p + beta * sum(points[j] for j in neighbours))
        elif len(creases) == 2:
            old.append(0.75 * p + 0.125 * (points[creases[0]] + points[creases[1]]))
        else:
            old.append(p)
    new = []
    for (a, b), c in sorted(around.items()):
        if len(c) == 2:
            new.append(0.375 * (points[a] + points[b]) + 0.125 * (points[c[0]] + points[c[1]]))
        else:
            new.append(0.5 * (points[a] + points[b]))
    return np.array(old + new)


@settings(max_examples=60, deadline=None)
@given(meshes())
def test_loop_equals_slow_reference(mesh):
    fine = subdivide_loop(mesh)
    np.testing.assert_allclose(fine.vertices, slow_loop(mesh), atol=1e-5)


@settings(max_examples=40, deadline=None)
@given(meshes())
def test_counts_and_places(mesh):
    pairs, _ = mesh_edges(mesh.faces, len(mesh.vertices))
    fine = subdivide_midpoint(mesh)
    assert len(fine.vertices) == len(mesh.vertices) + len(pairs)
    assert len(fine.faces) == 4 * len(mesh.faces)
    np.testing.assert_array_equal(fine.vertices[: len(mesh.vertices)], mesh.vertices)
    # The four children of a face have its normal and a quarter of its area each.
    quarters = np.repeat(mesh.face_areas[:, None] / 4, 4, axis=1)
    np.testing.assert_allclose(fine.face_areas.reshape(-1, 4), quarters, rtol=1e-3, atol=1e-6)
    big = mesh.face_areas > 1e-3
    normals = fine.face_normals.reshape(-1, 4, 3)
    np.testing.assert_allclose(normals[big], np.repeat(mesh.face_normals[big, None], 4, 1), atol=1e-2)


@pytest.mark.parametrize("subdivide", [subdivide_loop, subdivide_midpoint])
def test_topology_stays(subdivide):
    for mesh, genus, boundary in ((torus(6, 5), 1, 0), (grid(3, 2), 0, 40), (icosphere(2), 0, 0)):
        report = quality(subdivide(mesh, 2))
        assert report.genus == genus
        assert report.boundary_edges == boundary
        assert report.faces == 16 * len(mesh.faces)


def test_loop_converges_to_its_limit_positions():
    mesh = octahedron()
    n = 4
    beta = (5 / 8 - (3 / 8 + math.cos(2 * math.pi / n) / 4) ** 2) / n
    weight = 1.0 / (n + 3.0 / (8.0 * beta))  # Loop 1987: the limit is (1 - n w) p + w sum of the neighbours
    graph = mesh.edges
    around = np.add.reduceat(mesh.vertices[graph.indices].astype(float), graph.indptr[:-1])
    limit = (1 - n * weight) * mesh.vertices + weight * around
    fine = subdivide_loop(mesh, 6)
    np.testing.assert_allclose(fine.vertices[:6], limit, atol=1e-4)
    # One round further, vertices that were there already barely move.
    more = subdivide_loop(fine)
    assert np.abs(more.vertices[: len(fine.vertices)] - fine.vertices).max() < 1e-4


def test_loop_reproduces_planes_and_keeps_straight_borders():
    fine = subdivide_loop(grid(3, 3), 2)
    np.testing.assert_array_equal(fine.vertices[:, 2], 0.0)
    on_border = np.unique(fine.vertices[np.abs(fine.vertices[:, :2]).max(axis=1) > 0.999], axis=0)
    assert len(on_border) == 28  # of 48: the rule for borders rounds the four corners
    assert np.abs(fine.vertices).max() <= 1.0


def test_loop_of_an_open_fan():
    fine = subdivide_loop(Mesh(FAN_POINTS, FAN))
    np.testing.assert_allclose(
        fine.vertices[1], 0.75 * FAN_POINTS[1] + 0.125 * (FAN_POINTS[2] + FAN_POINTS[3])
    )


@pytest.mark.parametrize("subdivide", [subdivide_loop, subdivide_midpoint])
def test_corner_uvs_are_interpolated(subdivide):
    mesh = grid(2, 2)
    fine = subdivide(mesh, 2)
    assert fine.uv is not None
    if subdivide is subdivide_midpoint:
        np.testing.assert_allclose(fine.uv, (fine.vertices[fine.faces][..., :2] + 1.0) / 2.0, atol=1e-6)
    assert mesh.uv is not None
    # A seam stays one: corners of one vertex may differ, and their differences are halved, not mixed.
    seam = Mesh(mesh.vertices, mesh.faces, np.where(np.arange(8)[:, None, None] < 4, mesh.uv, mesh.uv + 5.0))
    parts = subdivide(seam).uv
    assert parts is not None
    assert parts[:16].max() <= 1.0
    assert parts[16:].min() >= 5.0


@pytest.mark.parametrize("times", range(5))
@pytest.mark.parametrize("outside", [0.0, 0.05])
def test_points_keep_their_places_on_the_children(rng, times, outside):
    """In space, on one of the face's own children; also points that lie a little beyond their face."""
    mesh = icosphere(2)
    fine = subdivide_midpoint(mesh, times)
    face = rng.integers(len(mesh.faces), size=400)
    weights = rng.dirichlet(np.ones(3), 400) * (1 + 3 * outside) - outside
    child, barycentric = child_points(face, weights, times)
    assert (child // 4**times == face).all()
    np.testing.assert_allclose(barycentric.sum(1), 1)
    assert barycentric.min() > -1e-9 - outside * 2**times
    places = [
        np.einsum("pk,pkd->pd", w, m.vertices[m.faces[f]].astype(float))
        for m, f, w in ((mesh, face, weights), (fine, child, barycentric))
    ]
    np.testing.assert_allclose(*places, atol=1e-6)


def test_points_on_sides_and_corners_of_children():
    """Where the middle child meets the others, the place is right whichever child is taken."""
    mesh, fine = octahedron(), subdivide_midpoint(octahedron(), 1)
    weights = np.array([[1, 0, 0], [0, 0, 1], [0.5, 0.5, 0], [0.5, 0.25, 0.25], [0, 0.5, 0.5]], np.float32)
    face = np.full(5, 3, np.int32)
    child, barycentric = child_points(face, weights, 1)
    assert child.dtype == np.int32 and barycentric.dtype == np.float32
    assert barycentric.min() >= 0
    np.testing.assert_allclose(
        np.einsum("pk,pkd->pd", barycentric, fine.vertices[fine.faces[child]]),
        np.einsum("pk,pkd->pd", weights, mesh.vertices[mesh.faces[face]]),
        atol=1e-6,
    )


def test_zero_times_is_the_same_mesh():
    mesh = octahedron()
    assert subdivide_loop(mesh, 0) is mesh


@pytest.mark.parametrize("subdivide", [subdivide_loop, subdivide_midpoint])
def test_impossible_numbers(subdivide):
    with pytest.raises(MeshError, match="-1 times"):
        subdivide(octahedron(), -1)
    with pytest.raises(MeshError, match="stay below 32,000,000"):
        subdivide(octahedron(), 12)


def test_midpoints_keep_hard_edges_and_interpolate_normals():
    mesh = octahedron()
    flat = Mesh(mesh.vertices, mesh.faces, None, "flat", np.repeat(mesh.face_normals[:, None], 3, axis=1))
    fine = subdivide_midpoint(flat, 2)
    assert fine.corner_normals is not None
    np.testing.assert_allclose(fine.corner_normals, np.repeat(fine.face_normals[:, None], 3, 1), atol=1e-6)
    round_one = Mesh(mesh.vertices, mesh.faces, None, "round", mesh.vertices[mesh.faces])
    fine = subdivide_midpoint(round_one)
    assert fine.corner_normals is not None
    np.testing.assert_allclose(fine.corner_normals, unit(fine.vertices)[fine.faces], atol=1e-6)
    # Where the ends of a side have opposite normals, the face's is in the middle.
    normals = mesh.vertices[mesh.faces].copy()
    normals[0, 1] = -normals[0, 0]
    fine = subdivide_midpoint(Mesh(mesh.vertices, mesh.faces, None, "folded", normals))
    assert fine.corner_normals is not None
    np.testing.assert_allclose(fine.corner_normals[0, 1], mesh.face_normals[0], atol=1e-6)


def test_loop_forgets_normals_and_both_forget_polygons():
    mesh = grid(1, 1)
    polygons = Polygons(np.array([4]), np.array([[0, 1, 2], [0, 2, 3]]))
    quad = Mesh(mesh.vertices, mesh.faces, mesh.uv, "quad", mesh.normals[mesh.faces], polygons)
    assert subdivide_loop(quad).corner_normals is None
    assert subdivide_loop(quad).polygons is None and subdivide_midpoint(quad).polygons is None
