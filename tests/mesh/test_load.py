"""Mesh files of every kind: what they give, and what is refused."""

import os
import warnings
from pathlib import Path

import numpy as np
import pytest

from mitex.errors import MeshError, MeshWarning
from mitex.mesh import Mesh, icosphere, quality
from tests.mesh.examples import (
    FAN_POINTS,
    TETRAHEDRON,
    exported_by_trimesh,
    obj_text,
    octahedron,
    ply_bytes,
)

SHARED = Path(__file__).parents[2].parent / "shared" / "data" / "meshes"

# As the README beside the files has it: vertices, faces, Euler characteristic, boundary edges, valence.
TABLE = {
    "spot": (10368, 20732, 2, 0, (3, 8)),
    "fish": (10744, 21484, 2, 0, (4, 9)),
    "violin": (10818, 21652, -8, 0, (3, 10)),
    "mug": (10720, 21440, 0, 0, (4, 8)),
    "chair": (10091, 20180, 2, 0, (4, 12)),
    "mobius": (10897, 21794, 0, 0, (5, 8)),
    "skull": (13029, 26062, -2, 0, (3, 10)),
    "mountain": (13664, 26929, 1, 397, (2, 8)),
}


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared meshes are not here")
@pytest.mark.parametrize("name", TABLE)
def test_shared_meshes_match_their_table(name):
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always")
        mesh = Mesh.load(SHARED / f"{name}.obj")
    report = quality(mesh)
    counts = (report.vertices, report.faces, report.euler, report.boundary_edges, report.valence[::2])
    assert counts == TABLE[name]
    assert report.components == 1
    assert [str(w.message).split(": ")[1] for w in record] == (
        ["kept edges of more than two faces (non-manifold)"] if name == "chair" else []
    )


def test_a_file_name_that_is_no_utf_8_is_escaped(tmp_path):
    path = tmp_path / "\udcff.ply"
    path.write_bytes(exported_by_trimesh(icosphere(1), "ply"))
    assert Mesh.load(path).name == "\\udcff"


@pytest.mark.parametrize("kind", ["obj", "ply", "stl", "glb", "gltf", "off"])
def test_reads_what_trimesh_writes(kind, tmp_path):
    mesh = icosphere(3)
    path = tmp_path / f"ball.{kind.upper()}"
    exported = exported_by_trimesh(mesh, kind)
    if isinstance(exported, dict):
        for name, data in exported.items():
            (tmp_path / name).write_bytes(data)
        path = tmp_path / "model.gltf"
    else:
        path.write_bytes(exported)
    loaded = Mesh.load(path)
    assert loaded.name == path.stem
    np.testing.assert_allclose(loaded.vertices[loaded.faces], mesh.vertices[mesh.faces], atol=1e-6)
    assert len(loaded.vertices) == len(mesh.vertices)
    if kind not in ("stl", "glb"):
        np.testing.assert_array_equal(loaded.faces, mesh.faces)


def test_text_stl(tmp_path):
    mesh = octahedron()
    path = tmp_path / "a.stl"
    path.write_bytes(exported_by_trimesh(mesh, "stl_ascii"))
    loaded = Mesh.load(path)
    assert len(loaded.vertices) == 6
    np.testing.assert_allclose(loaded.vertices[loaded.faces], mesh.vertices[mesh.faces])


def test_damaged_normals_of_a_text_stl_do_not_matter(tmp_path, caplog):
    data = exported_by_trimesh(octahedron(), "stl_ascii").replace(b"facet normal ", b"facet normal x")
    path = tmp_path / "a.stl"
    path.write_bytes(data)
    assert len(Mesh.load(path).faces) == 8
    assert not caplog.records


def test_binary_stl_with_something_after_it(tmp_path):
    mesh = octahedron()
    path = tmp_path / "a.stl"
    path.write_bytes(exported_by_trimesh(mesh, "stl") + b"more")
    assert len(Mesh.load(path).faces) == 8


def test_off_with_quads_and_comments(tmp_path):
    path = tmp_path / "a.off"
    path.write_text("OFF # square\n4 1 0\n0 0 0\n1 0 0 # corner\n1 1 0\n0 1 0\n4 0 1 2 3\n")
    assert len(Mesh.load(path).faces) == 2


@pytest.mark.parametrize("kind", ["obj", "stl"])
def test_signed_zeros_are_one_place(kind, tmp_path):
    path = tmp_path / f"a.{kind}"
    text = ""
    for a, b, c in (("0 0 0", "1 0 0", "0 1 0"), ("-0 0 0", "0 1 0", "-1 -0 0")):
        text += f"facet normal 0 0 1\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n"
    if kind == "obj":  # no two faces share a vertex: welded as well
        text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0.0 0 0\nv 0 1 0\nv -1 -0.0 0\nf 1 2 3\nf 4 5 6\n"
    else:
        text = f"solid a\n{text}endsolid a\n"
    path.write_text(text)
    mesh = Mesh.load(path)
    assert (len(mesh.vertices), len(mesh.faces)) == (4, 2)
    assert quality(mesh).components == 1


def test_sheets_that_touch_are_not_welded(tmp_path):
    # Two squares with a common corner position, but no shared vertex and nothing that says "seam".
    places = ["0 0", "1 0", "1 1", "0 1", "1 1", "2 1", "2 2", "1 2"]
    path = tmp_path / "a.obj"
    path.write_text("".join(f"v {p} 0\n" for p in places) + "f 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\n")
    with pytest.warns(MeshWarning, match="separate components: 2"):
        assert len(Mesh.load(path).vertices) == 8


def test_vertices_split_by_normals_are_welded(tmp_path):
    # A box corner: three squares, each with its own normal and its own copy of the shared vertices.
    squares = [
        ("1 0 0", ["0 0 0", "0 1 0", "0 1 1", "0 0 1"]),
        ("0 1 0", ["0 0 0", "0 0 1", "1 0 1", "1 0 0"]),
        ("0 0 1", ["0 0 0", "1 0 0", "1 1 0", "0 1 0"]),
    ]
    text = "".join(f"v {p}\n" for _, points in squares for p in points)
    text += "".join(f"vn {normal}\n" for normal, _ in squares)
    for n in range(3):
        text += f"f {' '.join(f'{4 * n + k + 1}//{n + 1}' for k in range(4))}\n"
    path = tmp_path / "a.obj"
    path.write_text(text)
    mesh = Mesh.load(path)
    assert (len(mesh.vertices), len(mesh.faces)) == (7, 6)
    assert quality(mesh).components == 1


def test_order_of_welded_vertices(tmp_path):
    path = tmp_path / "a.stl"
    mesh = octahedron()
    path.write_bytes(exported_by_trimesh(mesh, "stl"))
    loaded = Mesh.load(path)
    flat = loaded.faces.ravel().tolist()
    assert list(dict.fromkeys(flat)) == list(range(6))  # numbered as they appear


def assert_refused(path, words, **options):
    with pytest.raises(MeshError) as error, warnings.catch_warnings():
        warnings.simplefilter("error")
        Mesh.load(path, **options)
    assert words in error.value.problem
    assert Path(path).name[:40] in error.value.problem
    assert error.value.remedy
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.obj", b"", "empty (0 bytes)"),
        ("a.obj", b"# nothing\n", "no vertices"),
        ("a.obj", b"<html>404 not found</html>", "no vertices"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces, only 3 points"),
        ("a.obj", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is binary"),
        ("a.obj", b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS pointer"),
        ("a.ply", b"solid\n", "not a PLY file"),
        ("a.stl", b"hello", "not an STL file"),
        ("a.stl", b"solid of nothing\nendsolid\n", "no vertices"),
        ("a.off", b"hello\n", "not an OFF file"),
        ("a.off", b"OFF\nx y z\n", "does not say how many"),
        ("a.off", b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no faces"),
        ("a.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "outside"),
        ("a.off", b"OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends before"),
        ("a.off", b"OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends before"),
        ("a.off", b"OFF\n99 1 0\n0 0 0\n", "too many"),
        ("a.off", b"OFF\n-4 1 0\n0 0 0\n", "too many"),
        ("a.glb", b"hello", "not a glTF file"),
        ("a.gltf", b"[]", "not a glTF file"),
        ("a.fbx", b"Kaydara", "'.fbx'"),
        ("a", b"v 0 0 0", "no suffix"),
    ],
)
def test_refuses_files(name, content, words, tmp_path):
    path = tmp_path / name
    path.write_bytes(content)
    assert_refused(path, words)


def test_refuses_places(tmp_path):
    assert_refused(tmp_path / "none.obj", "there is no mesh")
    (tmp_path / "folder.obj").mkdir()
    assert_refused(tmp_path / "folder.obj", "is a folder")
    assert_refused("/dev/null", "not a regular file")
    assert_refused("x" * 5000, "there is no mesh")
    assert_refused("a\0b.obj", "there is no mesh")
    assert_refused("~nobody-of-this-name.obj", "there is no mesh")


def test_a_path_below_home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "a.obj").write_text(obj_text(octahedron()))
    assert len(Mesh.load("~/a.obj").faces) == 8


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_refuses_what_may_not_be_read(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(obj_text(octahedron()))
    path.chmod(0)
    assert_refused(path, "cannot be read")


def test_budget_is_checked_before_parsing(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\n" * 11 + "f this is not parsed\n")
    assert_refused(path, "11 vertices, more than the budget of 10", max_vertices=10)
    path = tmp_path / "a.ply"
    path.write_bytes(ply_bytes(FAN_POINTS, TETRAHEDRON).replace(b"vertex 4", b"vertex 9999999999"))
    assert_refused(path, "9,999,999,999 vertices")
    path = tmp_path / "a.stl"
    path.write_bytes(b"\0" * 80 + (1000).to_bytes(4, "little") + b"\0" * 50_000)
    assert_refused(path, "500 vertices, more than the budget of 10", max_vertices=10)
    path = tmp_path / "a.off"
    path.write_text("OFF\n11 1 0\n")
    assert_refused(path, "11 vertices, more than the budget of 10", max_vertices=10)


def test_file_size_is_checked_before_reading(tmp_path):
    path = tmp_path / "a.obj"
    with path.open("wb") as file:
        file.truncate(300 << 20)  # a hole: takes no space
    assert_refused(path, "300 MB, more than 256 MB", max_vertices=10)


def test_budget_counts_what_is_in_the_file(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(obj_text(octahedron()))
    assert len(Mesh.load(path, max_vertices=6).vertices) == 6
    assert_refused(path, "budget of 5", max_vertices=5)
