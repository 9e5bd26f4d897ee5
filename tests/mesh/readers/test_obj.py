"""Wavefront OBJ."""

import numpy as np
import pytest

from mitex.errors import MeshError, MeshWarning
from mitex.mesh import Mesh

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def load(tmp_path, text: str | bytes) -> Mesh:
    path = tmp_path / "a.obj"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return Mesh.load(path)


@pytest.mark.parametrize(
    "faces",
    [
        "f 1 2 3\nf 1 3 4\n",
        "f 1/1 2/1 3/1\nf 1/1 3/1 4/1\n",
        "f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n",
        "f 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/1/1\n",
        "f -4 -3 -2\nf -4 -2 -1\n",
        "f 1/ 2/ 3/\nf 1// 3// 4//\n",
        "f 1 2 3 4\n",
        "  f\t1  2 3\r\n\r\nf 1 3 4 # the other half\r\n",
        "f 1 2 \\\n3\nf 1 3 4",
        "usemtl red\nf 1 2 3\ng other\nusemtl blue\ns off\nf 1 3 4\n",
    ],
)
def test_ways_to_write_faces(faces, tmp_path):
    mesh = load(tmp_path, f"mtllib none.mtl\no thing\n{SQUARE}vt 0 0\nvn 0 0 1\n{faces}")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_relative_indices_count_from_their_line(tmp_path):
    first, second = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "v 0 0 5\nv 1 0 5\nv 0 1 5\n"
    with pytest.warns(MeshWarning, match="components: 2"):
        mesh = load(tmp_path, f"{first}f -3 -2 -1\n{second}f -3 -2 -1\n")
    assert mesh.faces.tolist() == [[0, 1, 2], [3, 4, 5]]


def test_colours_and_weights_after_the_position_are_ignored(tmp_path):
    mesh = load(tmp_path, "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 1.0\nf 1 2 3\n")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_a_uv_seam_does_not_split_vertices(tmp_path):
    # Vertices 1 and 3 lie on the seam between two charts.
    uvs = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.25 0.5\nvt 0.5 0.75\nvt 0.125 1\n"
    mesh = load(tmp_path, f"{SQUARE}{uvs}f 1/1 2/2 3/3\nf 1/4 3/5 4/6\n")
    assert len(mesh.vertices) == 4
    assert mesh.edges.valence.tolist() == [3, 2, 3, 2]
    assert mesh.uv is not None
    assert mesh.uv.tolist() == [[[0, 0], [1, 0], [1, 1]], [[0.25, 0.5], [0.5, 0.75], [0.125, 1]]]


def test_polygons_keep_their_uvs(tmp_path):
    mesh = load(tmp_path, f"{SQUARE}vt 0 0\nvt 9 0\nvt 9 9\nvt 0 9\nf 2/2 3/3 4/4 1/1\n")
    assert mesh.uv is not None
    np.testing.assert_array_equal(mesh.uv, 9.0 * mesh.vertices[mesh.faces][..., :2])


def test_one_dimensional_and_three_dimensional_uvs(tmp_path):
    mesh = load(tmp_path, f"{SQUARE}vt 0.5\nvt 0.25 0.75 0\nf 1/1 2/2 3/2\n".replace("v 0 1 0\n", ""))
    assert mesh.uv is not None
    assert mesh.uv.tolist() == [[[0.5, 0], [0.25, 0.75], [0.25, 0.75]]]


def test_partial_uvs_are_left_out(tmp_path):
    with pytest.warns(MeshWarning, match="only some faces have texture coordinates"):
        mesh = load(tmp_path, f"{SQUARE}vt 0 0\nf 1/1 2/1 3/1\nf 1 3 4\n")
    assert mesh.uv is None


def test_vertices_split_by_uvs_are_welded(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 0\nv 0 1 0\n"
    uvs = "".join(f"vt {k} 0\n" for k in range(6))
    mesh = load(tmp_path, f"{text}{uvs}f 1/1 2/2 3/3\nf 4/4 5/5 6/6\n")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.uv is not None
    assert mesh.uv[..., 0].tolist() == [[0, 1, 2], [3, 4, 5]]


def test_faces_with_two_corners_are_left_out(tmp_path):
    with pytest.warns(MeshWarning, match="fewer than 3 corners: 1"):
        assert len(load(tmp_path, f"{SQUARE}f 1 2\nf 1 2 3\nf 1 3 4\n").faces) == 2


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("f 1 2 5\n", "refers to vertex 4 (counted from 0) of only 4"),
        ("f 1 2 0\n", "line 5 of"),
        ("f 1 2 -9\n", "negative vertex index"),
        ("f 1 2 x\n", "line 5 of"),
        ("f 1 2 3.5\n", "line 5 of"),
        ("f 1 2 99999999999999999999999999\n", "line 5 of"),
        ("f /1 /1 /1\n", "line 5 of"),
        ("v 1 2\nf 1 2 3\n", "line 5 of"),
        ("v 1 2 three\nf 1 2 3\n", "line 5 of"),
        ("vt 0 0\nf 1/1 2/1 3/2\n", "texture coordinate does not exist"),
        ("vn 0 0 1\nf 1//1 2//1 3//-2\n", "normal does not exist"),
        ("v nan 0 0\nf 1 2 5\n", "NaN or infinite"),
        ("v 1e99 0 0\nf 1 2 5\n", "NaN or infinite"),
        ("f " + " ".join(["1", "2", "3"] * 700) + "\n", "2100 corners"),
    ],
)
def test_refuses(lines, words, tmp_path):
    with pytest.raises(MeshError) as error:
        load(tmp_path, SQUARE + lines)
    assert words in error.value.problem


def test_bytes_that_are_no_text_do_no_harm(tmp_path):
    mesh = load(tmp_path, b"# caf\xe9 \xff\n" + SQUARE.encode() + b"o \xfe\nf 1 2 3\nf 1 3 4\n")
    assert len(mesh.faces) == 2
    with pytest.raises(MeshError, match="line 2 of"):
        load(tmp_path, b"\nv 1 2 \xff\n")


def test_normals_of_some_faces_only_are_left_out(tmp_path):
    with pytest.warns(MeshWarning, match="only some faces have normals"):
        mesh = load(tmp_path, f"{SQUARE}vn 0 1 1\nf 1//1 2//1 3//1\nf 1 3 4\n")
    assert mesh.corner_normals is None


def test_faces_of_two_corners_do_not_shift_what_follows(tmp_path):
    values = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 1 1\nvn 0 0 1\n"
    text = f"{SQUARE}{values}f 1/1/2 2/1/2\nf 1/1/1 2/2/1 3/3/2 4/4/2\n"
    with pytest.warns(MeshWarning, match="fewer than 3 corners: 1"):
        mesh = load(tmp_path, text)
    assert mesh.polygons is not None and mesh.polygons.sizes.tolist() == [4]
    np.testing.assert_array_equal(mesh.uv, (mesh.vertices[:, :2])[mesh.faces])
    assert mesh.corner_normals is not None
    np.testing.assert_allclose(mesh.corner_normals[0], [[0, 0.5**0.5, 0.5**0.5]] * 2 + [[0, 0, 1]], atol=1e-6)
