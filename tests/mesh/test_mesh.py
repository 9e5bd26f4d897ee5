"""The mesh itself: checks, normals, edges, normalisation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitex.errors import MeshError
from mitex.mesh import Mesh, grid, icosphere
from mitex.mesh.polygons import Polygons
from tests.mesh.examples import FAN, FAN_POINTS, meshes, octahedron, tetrahedron


def test_arrays_are_float32_and_int32():
    mesh = Mesh(FAN_POINTS, FAN, np.zeros((3, 3, 2)))
    assert mesh.vertices.dtype == np.float32
    assert mesh.faces.dtype == np.int32
    assert mesh.uv is not None
    assert mesh.uv.dtype == np.float32


@pytest.mark.parametrize(
    ("vertices", "faces", "uv", "words"),
    [
        (FAN_POINTS[:, :2], FAN, None, "vertices have shape (4, 2)"),
        (FAN_POINTS, FAN[:, :2], None, "faces have shape (3, 2)"),
        (FAN_POINTS, FAN.astype(float), None, "faces are float64"),
        (FAN_POINTS, FAN, np.zeros((4, 2)), "uv has shape (4, 2)"),
        (FAN_POINTS, FAN - 1, None, "negative vertex index -1"),
        (FAN_POINTS, FAN + 1, None, "vertex 4, but there are only 4"),
        (np.where(FAN_POINTS == 1.0, np.nan, FAN_POINTS), FAN, None, "3 of 4 positions are NaN"),
        (FAN_POINTS * 1e39, FAN, None, "NaN or infinite"),
        (FAN_POINTS, FAN, np.full((3, 3, 2), np.inf), "texture coordinates"),
    ],
)
def test_refuses_wrong_arrays(vertices, faces, uv, words):
    with pytest.raises(MeshError) as error:
        Mesh(vertices, faces, uv, "thing")
    assert words in error.value.problem
    assert error.value.problem.startswith("thing: ")
    assert error.value.remedy


def test_nothing_of_a_mesh_can_be_changed():
    """Neither through its own arrays, nor through those that it was made from."""
    ball = icosphere(1)
    arrays = [ball.vertices.copy(), ball.faces.copy(), np.zeros((20, 3, 2), np.float32)]
    mesh = Mesh(*arrays, corner_normals=ball.normals[ball.faces])
    computed = [mesh.normals, mesh.face_normals, mesh.face_areas, mesh.face_crosses, mesh.edge_lengths]
    graph = [mesh.edges.indptr, mesh.edges.indices]
    assert mesh.uv is not None and mesh.corner_normals is not None
    for array in (mesh.vertices, mesh.faces, mesh.uv, mesh.corner_normals, *computed, *graph):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    for array in arrays:
        array += 1
    np.testing.assert_array_equal(mesh.vertices, ball.vertices)
    np.testing.assert_array_equal(mesh.faces, ball.faces)
    assert not mesh.uv.any()
    assert mesh.with_vertices(2 * mesh.vertices).faces is mesh.faces  # what is constant is shared


def test_indices_that_overflow_int32_are_refused():
    with pytest.raises(MeshError, match="4294967296"):
        Mesh(FAN_POINTS, np.array([[0, 1, 2**32]]))


@settings(max_examples=60, deadline=None)
@given(meshes())
def test_edges_equal_brute_force(mesh):
    neighbours = [set() for _ in mesh.vertices]
    for face in mesh.faces.tolist():
        for a in face:
            neighbours[a] |= set(face) - {a}
    graph = mesh.edges
    assert graph.indptr.dtype == graph.indices.dtype == np.int64
    assert graph.indptr[0] == 0
    for i, expected in enumerate(neighbours):
        assert graph.indices[graph.indptr[i] : graph.indptr[i + 1]].tolist() == sorted(expected)
        assert graph.valence[i] == len(expected)
    assert graph.rows.tolist() == [i for i, expected in enumerate(neighbours) for _ in expected]


def test_a_face_that_repeats_a_vertex_makes_no_edge_to_itself():
    graph = Mesh(FAN_POINTS, np.array([[0, 0, 1]])).edges
    assert graph.indices.tolist() == [1, 0]
    assert graph.valence.tolist() == [1, 1, 0, 0]


def test_edge_lengths_are_means_at_each_vertex():
    corners = np.array([(0, 0, 0), (3, 0, 0), (0, 4, 0), (9, 9, 9)])  # the last one has no edge
    np.testing.assert_allclose(Mesh(corners, np.array([(0, 1, 2)])).edge_lengths, (3.5, 4, 4.5, 4))
    np.testing.assert_array_equal(Mesh(corners, np.empty((0, 3), int)).edge_lengths, np.ones(4))


def test_no_faces_no_edges():
    mesh = Mesh(FAN_POINTS, np.empty((0, 3), int))
    assert mesh.edges.valence.tolist() == [0, 0, 0, 0]
    np.testing.assert_array_equal(mesh.normals, np.tile([0.0, 0.0, 1.0], (4, 1)))


@settings(max_examples=40, deadline=None)
@given(meshes())
def test_normals_equal_slow_area_weighting(mesh):
    total = np.zeros((len(mesh.vertices), 3))
    points = mesh.vertices.astype(float)
    for a, b, c in mesh.faces.tolist():
        u, v = points[b] - points[a], points[c] - points[a]
        cross = np.array([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
        for i in (a, b, c):
            total[i] += cross / 2.0
    for i, normal in enumerate(total):
        length = np.sqrt((normal**2).sum())
        if length > 1e-9:
            np.testing.assert_allclose(mesh.normals[i], normal / length, atol=2e-5)


def test_normals_weigh_areas_and_not_faces():
    # A large face in the xy plane and a small one in the yz plane share vertex 0.
    points = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 1, 0], [0, 0, 1]]
    mesh = Mesh(np.array(points, float), np.array([[0, 1, 2], [0, 3, 4]]))
    np.testing.assert_allclose(mesh.normals[0], np.array([0.5, 0.0, 8.0]) / np.hypot(0.5, 8.0), atol=1e-6)


def test_normals_of_a_sphere_point_outwards():
    sphere = icosphere(8)
    np.testing.assert_allclose((sphere.normals * sphere.vertices).sum(axis=1), 1.0, atol=2e-3)


def test_areas_and_face_normals():
    mesh = grid(3, 2)
    np.testing.assert_allclose(mesh.face_areas, 4.0 / 12.0, rtol=1e-6)
    np.testing.assert_allclose(mesh.face_normals, np.tile([0.0, 0.0, 1.0], (12, 1)), atol=1e-7)


def test_normalised_is_centred_and_has_radius_one():
    mesh = Mesh(octahedron().vertices * 7.0 + np.array([100.0, -3.0, 5.0], np.float32), octahedron().faces)
    small, similarity = mesh.normalised()
    np.testing.assert_allclose(small.vertices.mean(axis=0), 0.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(small.vertices, axis=1).max(), 1.0, rtol=1e-6)
    np.testing.assert_allclose(similarity.centre, [100.0, -3.0, 5.0], rtol=1e-6)
    assert similarity.scale == pytest.approx(7.0)


@settings(max_examples=40, deadline=None)
@given(meshes(), st.floats(1e-3, 1e3), st.floats(-50.0, 50.0))
def test_normalisation_round_trip(mesh, scale, shift):
    moved = mesh.with_vertices(mesh.vertices * scale + shift)
    small, similarity = moved.normalised()
    back = similarity.inverse(small.vertices)
    np.testing.assert_allclose(back, moved.vertices, atol=1e-6 * (similarity.scale + abs(shift)))
    np.testing.assert_allclose(similarity.inverse(similarity.apply(back)), back, rtol=1e-12, atol=1e-12)


def test_one_point_cannot_be_normalised():
    with pytest.raises(MeshError, match="at one point"):
        Mesh(np.ones((3, 3)), np.array([[0, 1, 2]])).normalised()


def test_with_vertices_keeps_the_rest():
    mesh = tetrahedron()
    edges = mesh.edges
    moved = mesh.with_vertices(mesh.vertices * 2.0)
    assert moved.edges is edges
    assert moved.name == mesh.name
    np.testing.assert_allclose(moved.face_areas, 4.0 * mesh.face_areas)
    with pytest.raises(MeshError, match="one position per vertex"):
        mesh.with_vertices(mesh.vertices[:2])
    with pytest.raises(MeshError, match="NaN"):
        mesh.with_vertices(mesh.vertices * np.nan)


UP = np.tile([0.0, 0.0, 1.0], (2, 3, 1))
QUAD = Polygons(np.array([4]), np.array([[0, 1, 2], [0, 2, 3]]))


def square(**more) -> Mesh:
    mesh = grid(1, 1)
    return Mesh(mesh.vertices, mesh.faces, mesh.uv, "square", **more)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"corner_normals": UP[:1]}, "corner_normals have shape (1, 3, 3)"),
        ({"corner_normals": UP * np.nan}, "not of length 1"),
        ({"corner_normals": UP * 1.01}, "not of length 1"),
        ({"corner_normals": UP * 0.0}, "not of length 1"),
        ({"polygons": Polygons(np.array([3, 3]), np.array([[0, 1, 2], [4, 5, 3]]))}, None),
        ({"polygons": Polygons(np.array([4]), np.array([[0, 1, 2], [0, 3, 2]]))}, "not those of the faces"),
        ({"polygons": Polygons(np.array([5]), np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]]))}, "not those of"),
        (
            {"polygons": Polygons(QUAD.sizes, QUAD.triangles, np.array([7, 1, 7, 3]))},
            "not those of the faces",
        ),
        ({"polygons": Polygons(QUAD.sizes, QUAD.triangles, np.array([7, 1, 5, 3]))}, None),
    ],
)
def test_refuses_normals_and_polygons_that_do_not_fit(more, words):
    if words is None:
        assert square(**more).polygons is more["polygons"]
        return
    with pytest.raises(MeshError) as error:
        square(**more)
    assert words in error.value.problem and error.value.problem.startswith("square: ")


def test_shading_normals_are_the_smooth_ones_unless_others_are_given():
    mesh = octahedron()
    np.testing.assert_array_equal(mesh.shading_normals, mesh.normals[mesh.faces])
    flat = np.repeat(mesh.face_normals[:, None], 3, axis=1)
    hard = mesh.with_shading_normals(flat)
    np.testing.assert_array_equal(hard.shading_normals, flat)
    np.testing.assert_array_equal(hard.normals, mesh.normals)
    assert hard.with_shading_normals(mesh.normals[mesh.faces]).corner_normals is None


def test_corner_normals_stay_where_the_mesh_is_only_moved_and_scaled():
    mesh = square(corner_normals=UP, polygons=QUAD)
    moved = mesh.with_vertices(3.0 * mesh.vertices + [100.0, 2.0, -7.0])
    np.testing.assert_array_equal(moved.corner_normals, UP)
    assert moved.normalised()[0].corner_normals is not None and moved.polygons is QUAD
    for shape in ([1.0, 1.0, 2.0], [1.0, 1.1, 1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]):
        other = mesh.with_vertices((mesh.vertices + [0.0, 0.0, 1e-3] * mesh.vertices[:, :1] ** 3) * shape)
        assert other.corner_normals is None and other.polygons is QUAD
    turned = mesh.with_vertices(mesh.vertices[:, [1, 2, 0]])
    assert turned.corner_normals is None


def test_a_mesh_is_taken_as_it_is_and_a_name_is_loaded():
    mesh = tetrahedron()
    assert Mesh.of(mesh) is mesh
    np.testing.assert_array_equal(Mesh.of("vase").vertices, Mesh.load("vase").vertices)
