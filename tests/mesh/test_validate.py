"""What is refused, what is mended."""

import warnings

import numpy as np
import pytest

from mitex.errors import MeshError, MeshWarning
from mitex.mesh import validate
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


@pytest.mark.parametrize("scale", [1e-18, 1e-3, 1e3, 1e15])
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
