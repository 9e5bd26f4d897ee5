"""What walks on: seams, windings, strange edges and faces without area, seen by the walks over them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitex.mesh import Mesh, grid
from mitex.methods.surface.exponential import GeodesicTracer
from tests.mesh.examples import meshes
from tests.methods.surface.walks import bumpy, end_points, locate, positions, random_rays

EVEN = np.full(3, 1.0 / 3.0)


def _flip(mesh: Mesh, rng) -> Mesh:
    """Half of the faces turned over."""
    over = rng.random(len(mesh.faces)) < 0.5
    return Mesh(mesh.vertices, np.where(over[:, None], mesh.faces[:, [1, 0, 2]], mesh.faces))


def test_windings_do_not_matter(rng):
    mesh = bumpy(rng)
    face, weights, direction = random_rays(mesh, 500, rng)
    flipped = _flip(mesh, rng)
    turned = np.where((flipped.faces == mesh.faces)[face], weights, weights[:, [1, 0, 2]])
    expected = GeodesicTracer(mesh).trace(face, weights, direction, 2.0)
    arrival = GeodesicTracer(flipped).trace(face, turned, direction, 2.0)
    assert arrival.arrived.all()
    np.testing.assert_allclose(end_points(flipped, arrival), end_points(mesh, expected), atol=1e-10)


def test_split_vertices_are_seams_that_can_be_crossed(rng):
    mesh = bumpy(rng)
    soup = Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))
    face, weights, direction = random_rays(mesh, 500, rng)
    one = GeodesicTracer(mesh).trace(face, weights, direction, 2.0)
    other = GeodesicTracer(soup).trace(face, weights, direction, 2.0)
    assert other.arrived.all()
    np.testing.assert_array_equal(one.face, other.face)
    np.testing.assert_array_equal(one.barycentric, other.barycentric)


def test_zero_has_no_sign():
    vertices = np.array([[0.0, 0, 0], [0, 1, 0], [-1, 0, 0], [-0.0, 0, -0.0], [1, 0, 0], [0, 1, -0.0]])
    mesh = Mesh(vertices, np.arange(6).reshape(2, 3))
    arrival = GeodesicTracer(mesh).trace([0], EVEN[None], [[1.0, 0, 0]], 0.5)
    assert arrival.arrived.all()
    np.testing.assert_allclose(end_points(mesh, arrival), [[-1 / 3 + 0.5, 1 / 3, 0]], atol=1e-15)


@pytest.mark.parametrize("corners", [5, 7, 9])
def test_once_around_a_moebius_strip(corners, rng):
    """The faces (i, i + 1, i + 2) of a regular polygon: folded flat, and unfolded a straight strip."""
    angle = np.arange(corners) * 2 * np.pi / corners
    vertices = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    faces = (np.arange(corners)[:, None] + np.arange(3)) % corners
    mesh = Mesh(vertices, faces)
    tracer = GeodesicTracer(mesh)
    around = corners * np.sin(2 * np.pi / corners)  # half a long diagonal for each face
    along = 0.5 * (vertices[2] - vertices[0])
    middle, aside = np.array([[0.5, 0.5, 0.0]]), np.array([[0.6, 0.4, 0.0]])
    once = end_points(mesh, tracer.trace([0], middle, along[None], around))
    np.testing.assert_allclose(once, positions(mesh, [0], middle), atol=1e-6)
    other = end_points(mesh, tracer.trace([0], aside, along[None], around))
    twice = end_points(mesh, tracer.trace([0], aside, along[None], 2 * around))
    np.testing.assert_allclose(twice, positions(mesh, [0], aside), atol=1e-6)
    assert np.linalg.norm(other - twice) > 0.01


def test_edges_of_three_faces_stop_walks(rng):
    mesh = grid(4, 4)
    middle = [int(np.flatnonzero((mesh.vertices[:, :2] == xy).all(axis=1))[0]) for xy in ((0, 0), (0, 0.5))]
    finned = Mesh(np.r_[mesh.vertices, [[0, 0.25, 1.0]]], np.r_[mesh.faces, [[*middle, len(mesh.vertices)]]])
    face, weights = locate(finned, (-0.25, 0.25))
    arrival = GeodesicTracer(finned).trace(face, weights, np.array([[1.0, 0.1, 0.0]]), 1.0)
    assert not arrival.arrived.any()
    np.testing.assert_allclose(end_points(finned, arrival), [[0.0, 0.275, 0.0]], atol=1e-14)
    assert GeodesicTracer(mesh).trace(face, weights, np.array([[1.0, 0.1, 0.0]]), 1.0).arrived.all()


def _halves(between) -> Mesh:
    """The rectangle [-1, 1] x [0, 1]; along x = 0 are one side on the left and two on the right."""
    vertices = [[-1, 0, 0], [-1, 1, 0], [0, 0, 0], [0, 1, 0], [0, 0.375, 0], [1, 0, 0], [1, 1, 0]]
    left, right = [[0, 2, 3], [0, 3, 1]], [[2, 5, 4], [4, 5, 6], [4, 6, 3]]
    return Mesh(np.array(vertices, float), np.array(left + right + between))


CAPS = [[[2, 3, 4]], [[3, 2, 4]], [[4, 2, 3]], [[2, 4, 3]], [[3, 4, 2], [2, 2, 5]]]


@pytest.mark.parametrize("cap", CAPS)
@pytest.mark.parametrize("height", [0.1, 0.375, 0.5, 0.9])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_collinear_faces_are_walked_through(cap, height, way):
    mesh = _halves(cap)
    face, weights = locate(mesh, (-0.5 * way, height))
    arrival = GeodesicTracer(mesh).trace(face, weights, [[way, 0.0, 0.0]], 1.25)
    assert arrival.arrived.all()
    np.testing.assert_allclose(end_points(mesh, arrival), [[0.75 * way, height, 0.0]], atol=1e-14)


@pytest.mark.parametrize("cap", [*CAPS, []])
def test_walks_along_a_collinear_face_go_on(cap):
    mesh = _halves(cap)
    for start in (0.0, 0.125):
        face, weights = locate(mesh, (0.0, start))
        arrival = GeodesicTracer(mesh).trace(face, weights, [[0.0, 1.0, 0.0]], 0.75)
        assert arrival.arrived.all()
        np.testing.assert_allclose(end_points(mesh, arrival), [[0.0, start + 0.75, 0.0]], atol=1e-14)


def test_t_junctions_are_boundaries():
    mesh = _halves([])
    face, weights = locate(mesh, (-0.5, 0.5))
    arrival = GeodesicTracer(mesh).trace(face, weights, [[1.0, 0.0, 0.0]], 1.25)
    assert not arrival.arrived.any()
    np.testing.assert_allclose(end_points(mesh, arrival), [[0.0, 0.5, 0.0]], atol=1e-14)


@pytest.mark.parametrize("copies", [1, 2])
def test_faces_with_a_repeated_corner_are_left_out(copies):
    """Also where the corners differ in number only; they connect, since they are as wide as the seam."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 0]], float)
    mesh = Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3], *[[0, 2, 4]] * copies, [2, 4, 2]]))
    tracer = GeodesicTracer(mesh)
    arrival = tracer.trace([0], EVEN[None], [[-1.0, 1.0, 0.0]], 0.5)
    assert arrival.arrived.all() and arrival.face[0] == 1
    expected = np.array([[2 / 3, 1 / 3, 0]]) + 0.5 * math.sqrt(0.5) * np.array([[-1, 1, 0]])
    np.testing.assert_allclose(end_points(mesh, arrival), expected, atol=1e-14)
    stuck = tracer.trace([2, len(mesh.faces) - 1], [EVEN, EVEN], [[1.0, 0, 0], [0, 0, 1]], 0.5)
    assert not stuck.arrived.any()
    np.testing.assert_array_equal(stuck.face, [2, len(mesh.faces) - 1])
    np.testing.assert_allclose(stuck.barycentric, 1 / 3, atol=1e-15)


def test_one_triangle():
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    arrival = GeodesicTracer(mesh).trace([0, 0], [EVEN, EVEN], [[1.0, 0, 0], [1, 0, 0]], [0.25, 0.5])
    np.testing.assert_array_equal(arrival.arrived, [True, False])
    np.testing.assert_allclose(end_points(mesh, arrival), [[7 / 12, 1 / 3, 0], [2 / 3, 1 / 3, 0]], atol=1e-15)


def test_two_sides_of_one_triangle():
    """A pillow: the walk comes back on the other side."""
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 1]]))
    arrival = GeodesicTracer(mesh).trace([0], [[1 / 3, 1 / 3, 1 / 3]], [[0.0, -1.0, 0.0]], 0.5)
    assert arrival.arrived.all() and arrival.face[0] == 1
    np.testing.assert_allclose(end_points(mesh, arrival), [[1 / 3, 1 / 6, 0]], atol=1e-15)


@settings(max_examples=60, deadline=None)
@given(mesh=meshes(), seed=st.integers(0, 2**32 - 1), whole=st.booleans())
def test_any_triangles(mesh, seed, whole):
    """Nothing is NaN, and no walk gets farther than its length; whole coordinates give faces without area."""
    if whole:
        mesh = mesh.with_vertices(np.round(mesh.vertices))
    rng = np.random.default_rng(seed)
    face = rng.integers(0, len(mesh.faces), 64)
    weights = rng.dirichlet([0.3, 0.3, 0.3], 64)
    weights[:20] = np.eye(3)[rng.integers(0, 3, 20)]  # at a corner
    weights[20:40, 0] = 0.0  # on a side
    weights[20:40] /= weights[20:40].sum(axis=1, keepdims=True)
    length = rng.exponential(2.0, 64)
    direction = np.round(2.0 * rng.normal(size=(64, 3)))
    corners = mesh.vertices[mesh.faces[face]]
    direction[::2] = (corners[:, 2] - corners[:, 1])[::2]  # along a side
    arrival = GeodesicTracer(mesh).trace(face, weights, direction, length)
    away = np.linalg.norm(end_points(mesh, arrival) - positions(mesh, face, weights), axis=1)
    assert (away <= length + 1e-9).all()
