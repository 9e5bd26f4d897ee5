"""What is refused, what is mended."""

import warnings

import numpy as np
import pytest

from mitex.errors import MeshError, MeshWarning
from mitex.mesh import validate
from mitex.mesh.polygons import Polygons
from tests.mesh.examples import FAN, FAN_POINTS, OCTAHEDRON, OCTAHEDRON_POINTS


def quiet(*args, **kwargs):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return validate(*args, **kwargs)


def test_a_sound_mesh_passes_silently():
    mesh = quiet(OCTAHEDRON_POINTS, OCTAHEDRON)
    np.testing.assert_array_equal(mesh.faces, OCTAHEDRON)
    np.testing.assert_array_equal(mesh.vertices, OCTAHEDRON_POINTS)


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (np.empty((0, 3)), np.empty((0, 3), int), "it has no vertices"),
        (FAN_POINTS, np.empty((0, 3), int), "no faces, only 4 points"),
        (FAN_POINTS, FAN + 1, "vertex 4"),
        (FAN_POINTS, FAN - 1, "negative vertex index"),
        (FAN_POINTS * [1.0, np.nan, 1.0], FAN, "NaN"),
        (FAN_POINTS / np.array([[1.0], [1e-300], [1.0], [1.0]]), FAN, "infinite"),
        (FAN_POINTS, FAN[:, [0, 0, 1]], "all 3 faces"),
        (FAN_POINTS * [1.0, 0.0, 0.0], FAN, "all 3 faces"),
        (FAN_POINTS * 0.0, FAN, "all 3 faces"),
        (FAN_POINTS * 1e30, FAN, "e+30 units large"),
        (FAN_POINTS * 1e-30, FAN, "e-30 units large"),
    ],
)
def test_refuses(vertices, faces, words):
    with pytest.raises(MeshError) as error:
        quiet(vertices, faces, name="thing")
    assert words in error.value.problem
    assert "thing" in error.value.problem
    assert error.value.remedy


def test_refuses_what_is_over_budget():
    assert len(quiet(FAN_POINTS, FAN, max_vertices=4).vertices) == 4
    with pytest.raises(MeshError, match="4 vertices, more than the budget of 3"):
        quiet(FAN_POINTS, FAN, max_vertices=3)


def mended(vertices, faces, words, uv=None):
    with pytest.warns(MeshWarning, match=words) as record:
        mesh = validate(vertices, faces, uv, name="thing")
    assert len(record) == 1
    assert str(record[0].message).startswith("thing: ")
    return mesh


@pytest.mark.parametrize("bad", [[0, 0, 1], [2, 3, 3], [1, 4, 2]])
def test_degenerate_faces_are_dropped(bad):
    # Vertex 4 is in the middle between 1 and 2, and is needed by another face.
    points = np.concatenate([FAN_POINTS, [[0.5, 0.5, 0.0]]])
    faces = np.array([[0, 1, 4], [0, 4, 2], bad, [0, 2, 3]])
    uv = np.arange(24.0).reshape(4, 3, 2)
    mesh = mended(points, faces, "dropped degenerate faces .*: 1$", uv)
    np.testing.assert_array_equal(mesh.faces, faces[[0, 1, 3]])
    np.testing.assert_array_equal(mesh.uv, uv[[0, 1, 3]])


@pytest.mark.parametrize("scale", [1e-15, 1e-3, 1e3, 1e14])
def test_what_is_degenerate_does_not_depend_on_the_scale(scale):
    assert len(quiet(OCTAHEDRON_POINTS * scale, OCTAHEDRON).faces) == 8


def test_thin_faces_stay():
    points = FAN_POINTS * [1.0, 1e-4, 1.0]
    assert len(quiet(points, FAN).faces) == 3


def test_repeated_faces_are_dropped_whatever_their_winding():
    faces = np.concatenate([OCTAHEDRON[:1], OCTAHEDRON, OCTAHEDRON[3:4, ::-1], OCTAHEDRON[5:6, [1, 2, 0]]])
    mesh = mended(OCTAHEDRON_POINTS, faces, "dropped repeated faces: 3$")
    np.testing.assert_array_equal(mesh.faces, OCTAHEDRON)


def test_unused_vertices_are_dropped_and_the_rest_keeps_its_order():
    points = np.insert(OCTAHEDRON_POINTS, [0, 3], 9.0, axis=0)
    where = np.array([1, 2, 3, 5, 6, 7])
    mesh = mended(points, where[OCTAHEDRON], "dropped vertices without a face: 2$")
    np.testing.assert_array_equal(mesh.vertices, OCTAHEDRON_POINTS)
    np.testing.assert_array_equal(mesh.faces, OCTAHEDRON)


def test_non_manifold_edges_are_kept():
    points = np.concatenate([OCTAHEDRON_POINTS, [[2.0, 2.0, 2.0]]])
    mesh = mended(points, np.concatenate([OCTAHEDRON, [[0, 2, 6]]]), "more than two faces .*: 1$")
    assert len(mesh.faces) == 9


def test_components_are_kept():
    points = np.concatenate([OCTAHEDRON_POINTS, OCTAHEDRON_POINTS + 5.0])
    mesh = mended(points, np.concatenate([OCTAHEDRON, OCTAHEDRON + 6]), "separate components: 2")
    assert len(mesh.faces) == 16


def test_opposite_winding_is_reported():
    faces = OCTAHEDRON.copy()
    faces[2] = faces[2, ::-1]
    mesh = mended(OCTAHEDRON_POINTS, faces, "opposite winding: 3")
    np.testing.assert_array_equal(mesh.faces, faces)


def test_uvs_that_are_not_finite_are_left_out():
    uv = np.zeros((3, 3, 2))
    uv[1, 2, 0] = np.nan
    assert mended(FAN_POINTS, FAN, "texture coordinates", uv).uv is None


FLAT = np.sign(OCTAHEDRON_POINTS[OCTAHEDRON].mean(axis=1))[:, None].repeat(3, axis=1)  # not of length 1


def test_normals_are_made_unit_and_kept():
    mesh = quiet(OCTAHEDRON_POINTS, OCTAHEDRON, corner_normals=FLAT)
    assert mesh.corner_normals is not None
    np.testing.assert_allclose(mesh.corner_normals, FLAT / np.sqrt(3.0), atol=1e-6)


def test_normals_that_are_the_smooth_ones_are_not_kept():
    assert (
        quiet(OCTAHEDRON_POINTS, OCTAHEDRON, corner_normals=OCTAHEDRON_POINTS[OCTAHEDRON]).corner_normals
        is None
    )


@pytest.mark.parametrize("bad", [np.nan, np.inf, 0.0])
def test_damaged_normals_are_left_out(bad):
    normals = FLAT.copy()
    normals[3, 1] *= bad
    with pytest.warns(MeshWarning, match="some normals are NaN, infinite or zero"):
        mesh = validate(OCTAHEDRON_POINTS, OCTAHEDRON, corner_normals=normals)
    assert mesh.corner_normals is None


def test_normals_that_look_inwards_are_left_out():
    with pytest.warns(MeshWarning, match="look away from the faces on 100% of the area"):
        assert validate(OCTAHEDRON_POINTS, OCTAHEDRON, corner_normals=-FLAT).corner_normals is None
    few = np.where(np.arange(8)[:, None, None] == 2, -FLAT, FLAT)
    with pytest.warns(MeshWarning, match="look away from the faces on 12% of the area"):
        assert validate(OCTAHEDRON_POINTS, OCTAHEDRON, corner_normals=few).corner_normals is None


def test_a_sliver_may_have_normals_of_its_own():
    points = np.concatenate([OCTAHEDRON_POINTS, [[1.0, 0.0, 1e-4]]])
    with pytest.warns(MeshWarning, match="more than two faces"):
        mesh = validate(
            points,
            np.concatenate([OCTAHEDRON, [[0, 2, 6]]]),
            corner_normals=np.concatenate([FLAT, [[[0, 0, 1.0]] * 3]]),
        )
    assert mesh.corner_normals is not None


def test_normals_of_a_wrong_shape_are_refused():
    with pytest.raises(MeshError, match="corner_normals have shape"):
        quiet(OCTAHEDRON_POINTS, OCTAHEDRON, corner_normals=FLAT[:, 0])


def test_polygons_and_normals_of_dropped_faces_go():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 3], [1, 0, 4], [0, 3, 4]])
    polygons = Polygons(
        np.array([4, 3, 3, 3]), np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12]])
    )
    normals = np.tile([0.0, 0.0, 1.0], (5, 3, 1))
    normals[3], normals[4] = [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]
    with pytest.warns(MeshWarning, match="degenerate faces"):
        mesh = validate(points, faces, corner_normals=normals, polygons=polygons)
    assert mesh.polygons is not None and mesh.polygons.sizes.tolist() == [4, 3, 3]
    np.testing.assert_array_equal(mesh.shading_normals, normals[[0, 1, 3, 4]])
