"""Stanford PLY."""

import struct

import numpy as np
import pytest

from mitex.errors import MeshError, MeshWarning
from mitex.mesh import Mesh
from tests.mesh.examples import FAN_POINTS, TETRAHEDRON, ply_bytes

TEXT = """ply
format ascii 1.0
comment made by hand
obj_info nothing
element vertex 4
property float x
property float y
property float z
element face 2
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
1 1 0
0 1 0
3 0 1 2
3 0 2 3
"""


def load(tmp_path, data: str | bytes) -> Mesh:
    path = tmp_path / "a.ply"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return Mesh.load(path)


def test_text(tmp_path):
    mesh = load(tmp_path, TEXT)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert load(tmp_path, TEXT.replace("\n", "\r\n")).faces.tolist() == mesh.faces.tolist()
    assert load(tmp_path, TEXT.replace("indices", "index")).faces.tolist() == mesh.faces.tolist()


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary(order, tmp_path):
    mesh = load(tmp_path, ply_bytes(FAN_POINTS, TETRAHEDRON, order))
    np.testing.assert_array_equal(mesh.vertices, FAN_POINTS)
    np.testing.assert_array_equal(mesh.faces, TETRAHEDRON)


@pytest.mark.parametrize("order", ["<", ">", "text"])
def test_triangles_and_quads_mixed(order, tmp_path):
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]]
    if order == "text":
        data = TEXT.replace("vertex 4", "vertex 5").replace(
            "0 1 0\n3 0 1 2\n3 0 2 3", "0 1 0\n2 0 0\n4 0 1 2 3\n3 1 4 2"
        )
    else:
        data = ply_bytes(points, [[0, 1, 2, 3], [1, 4, 2]], order)
    mesh = load(tmp_path, data)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]


def test_other_columns_elements_and_names(tmp_path):
    header = (
        "ply\nformat binary_little_endian 1.0\nelement camera 1\nproperty list uint8 float32 view\n"
        "element vertex 3\nproperty uchar red\nproperty double z\nproperty double x\nproperty double y\n"
        "property uchar red\nelement face 1\nproperty uchar flags\n"
        "property list uint16 uint16 vertex_index\nproperty list uchar float texcoord\n"
        "element edge 5\nproperty int a\nend_header\n"
    )
    body = struct.pack("<B2f", 2, 1.0, 2.0)
    for x, y, z in [(0, 0, 7), (1, 0, 8), (0, 1, 9)]:
        body += struct.pack("<B3dB", 255, z, x, y, 1)
    body += struct.pack("<BH3HB6f", 1, 3, 0, 1, 2, 6, *np.arange(6.0))
    mesh = load(tmp_path, header.encode() + body)
    assert mesh.vertices.tolist() == [[0, 0, 7], [1, 0, 8], [0, 1, 9]]
    assert mesh.uv is not None
    assert mesh.uv.tolist() == [[[0, 1], [2, 3], [4, 5]]]


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_vertex_uvs_and_the_seams_that_they_split(names, tmp_path):
    rows = [
        [0, 0, 0, 0, 0],
        [1, 0, 0, 1, 0],
        [1, 1, 0, 1, 1],
        [0, 0, 0, 5, 5],
        [1, 1, 0, 6, 6],
        [0, 1, 0, 5, 6],
    ]
    mesh = load(tmp_path, ply_bytes(rows, [[0, 1, 2], [3, 4, 5]], columns=("x", "y", "z", *names)))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.uv is not None
    assert mesh.uv.tolist() == [[[0, 0], [1, 0], [1, 1]], [[5, 5], [6, 6], [5, 6]]]


def test_coincident_vertices_without_seams_stay_apart(tmp_path):
    rows = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0]]
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    with pytest.warns(MeshWarning, match="components: 2"):
        assert len(load(tmp_path, ply_bytes(rows, faces)).vertices) == 8
    # With one normal per sheet the vertices of that place differ: a seam.
    normals = np.repeat([[0.0, 0.0, 1.0], [0.0, 0.1, 1.0]], 4, axis=0)
    columns = ("x", "y", "z", "nx", "ny", "nz")
    assert len(load(tmp_path, ply_bytes(np.hstack([rows, normals]), faces, columns=columns)).vertices) == 7


GOOD = ply_bytes(FAN_POINTS, TETRAHEDRON)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (ply_bytes(FAN_POINTS, [[0, 1, 2], [0, 1, 4]]), "refers to vertex 4"),
        (ply_bytes(FAN_POINTS, [[0, 1, -2]]), "negative vertex index -2"),
        (ply_bytes(FAN_POINTS + np.inf, TETRAHEDRON), "NaN or infinite"),
        (ply_bytes(FAN_POINTS, []), "no faces, only 4 points"),
        (ply_bytes(np.empty((0, 3)), []), "no vertices"),
        (ply_bytes(FAN_POINTS, TETRAHEDRON, columns=("x", "y", "w")), "no vertex positions"),
        (GOOD[:-1], "ends before its 4 face elements"),
        (GOOD[:-30], "ends before"),
        (GOOD[: GOOD.index(b"end_header") + 40], "ends before its 4 vertex"),
        (GOOD[: GOOD.index(b"end_header")], "not a PLY file"),
        (GOOD.replace(b"ply\n", b"plx\n"), "not a PLY file"),
        (GOOD.replace(b"property float x", b"property quad x"), "bad line: 'property quad x'"),
        (GOOD.replace(b"property float x", b"property"), "bad line"),
        (GOOD.replace(b"element vertex 4", b"element vertex many"), "bad line"),
        (GOOD.replace(b"element vertex 4", b"element vertex -4"), "bad line"),
        (GOOD.replace(b"element vertex 4\n", b""), "bad line"),
        (GOOD.replace(b"binary_little", b"binary_middle"), "bad line"),
        (GOOD.replace(b"format binary_little_endian 1.0\n", b""), "no format"),
        (ply_bytes(FAN_POINTS, TETRAHEDRON, face_count=10**12), "more than it has bytes"),
        (ply_bytes(FAN_POINTS, TETRAHEDRON, face_count=5), "ends before its 5 face"),
        (TEXT.replace("3 0 2 3\n", ""), "ends before its 2 face"),
        (TEXT.replace("3 0 2 3\n", "-3 0 2 3\n"), "list of -3.0 numbers"),
        (TEXT.replace("3 0 2 3\n", "nan 0 2 3\n"), "list of nan numbers"),
        (TEXT.replace("3 0 2 3\n", "3 0 2 nan\n"), "negative vertex index"),
        (TEXT.replace("1 1 0", "1 one 0"), "something between its numbers"),
        (TEXT.replace("1 1 0", "inf 1 0"), "NaN or infinite"),
        (TEXT.replace("3 0 2 3", "3 0 2 4"), "refers to vertex 4"),
    ],
)
def test_refuses(data, words, tmp_path):
    with pytest.raises(MeshError) as error:
        load(tmp_path, data)
    assert words in error.value.problem
