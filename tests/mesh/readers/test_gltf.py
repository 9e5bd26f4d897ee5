"""glTF 2.0."""

import base64
import json
import math
import struct

import numpy as np
import pytest
import trimesh

from mitex.errors import MeshError, MeshWarning
from mitex.mesh import Mesh
from tests.mesh.examples import FAN_POINTS, OCTAHEDRON, OCTAHEDRON_POINTS, TETRAHEDRON, glb_bytes, gltf

PART = {"positions": FAN_POINTS, "indices": TETRAHEDRON}


def load(tmp_path, tree, blob, **options) -> Mesh:
    path = tmp_path / "a.glb"
    path.write_bytes(glb_bytes(tree, blob))
    return Mesh.load(path, **options)


def corners(mesh: Mesh) -> np.ndarray:
    return mesh.vertices[mesh.faces]


def test_plain(tmp_path):
    mesh = load(tmp_path, *gltf([PART]))
    np.testing.assert_array_equal(mesh.vertices, FAN_POINTS)
    np.testing.assert_array_equal(mesh.faces, TETRAHEDRON)


def test_nodes_agree_with_trimesh(tmp_path):
    quaternion = [0.5, -0.1, 0.7, math.sqrt(1.0 - 0.25 - 0.01 - 0.49)]
    shear = [1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0.25, 2, 0, 10, 20, 30, 1]
    nodes = [
        {"children": [1, 2], "translation": [1, 2, 3], "rotation": quaternion, "scale": [1, 2, 3]},
        {"mesh": 0, "rotation": quaternion[::-1], "scale": [1, 1, 0.5]},
        {"children": [3], "matrix": shear},
        {"mesh": 1, "translation": [0, 0, -4]},
        {"mesh": 1},
    ]
    tree, blob = gltf(
        [PART, {"positions": OCTAHEDRON_POINTS, "indices": OCTAHEDRON}],
        nodes,
        scenes=[{"nodes": [4, 0]}],
        scene=0,
    )
    with pytest.warns(MeshWarning, match="components: 3"):
        mesh = load(tmp_path, tree, blob)
    scene = trimesh.load_scene(tmp_path / "a.glb", process=False, maintain_order=True)
    reference = scene.to_mesh()
    triangles = np.sort(corners(mesh).reshape(-1, 9).round(4), axis=0)
    np.testing.assert_allclose(triangles, np.sort(reference.triangles.reshape(-1, 9), axis=0), atol=2e-4)
    assert len(mesh.vertices) == 4 + 6 + 6


def test_nodes_outside_the_scene_are_left_out(tmp_path):
    nodes = [{"mesh": 0}, {"mesh": 0, "translation": [9, 9, 9]}]
    assert len(load(tmp_path, *gltf([PART], nodes, scenes=[{"nodes": [0]}])).faces) == 4


def test_mirrored_nodes_keep_faces_outwards(tmp_path):
    mesh = load(tmp_path, *gltf([PART], [{"mesh": 0, "scale": [-1, 1, 1]}]))
    a, b, c = np.moveaxis(corners(mesh).astype(float), 1, 0)
    assert (a * np.cross(b, c)).sum() > 0.0


def test_parts_are_welded_together(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]], float)
    other = np.array([[0, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    mesh = load(tmp_path, *gltf([{"positions": points}, {"positions": other}]))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (4, [0, 1, 2, 0, 2, 3], [[0, 1, 2], [0, 2, 3]]),
        (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
        (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
    ],
)
def test_strips_and_fans(mode, indices, expected, tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    mesh = load(tmp_path, *gltf([{"positions": points, "indices": indices, "mode": mode}]))
    assert mesh.faces.tolist() == expected
    assert (mesh.face_normals[:, 2] > 0.0).all()


def test_uvs_are_counted_upwards_and_need_no_material(tmp_path):
    uv = np.array([[0.0, 0.0], [1.0, 0.25], [0.5, 1.0], [0.25, 0.75]], np.float32)
    mesh = load(tmp_path, *gltf([{**PART, "uv": uv}]))
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.uv, np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)[TETRAHEDRON])


@pytest.mark.parametrize(("kind", "top"), [(np.uint8, 255), (np.uint16, 65535)])
def test_integer_uvs(kind, top, tmp_path):
    uv = np.array([[0, 0], [top, 0], [top, top], [0, top]], kind)
    mesh = load(tmp_path, *gltf([{**PART, "uv": uv}]))
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.uv[0], [[0, 1], [1, 0], [1, 1]])


def test_uvs_of_some_parts_only_are_left_out(tmp_path):
    far = {"positions": FAN_POINTS + 5.0, "indices": TETRAHEDRON}
    with pytest.warns(MeshWarning) as record:
        mesh = load(tmp_path, *gltf([{**PART, "uv": np.zeros((4, 2), np.float32)}, far]))
    assert any("only some parts" in str(w.message) for w in record)
    assert mesh.uv is None


def test_interleaved_data(tmp_path):
    tree, _ = gltf([PART])
    rows = np.hstack([FAN_POINTS, np.full((4, 3), 99.0)]).astype("<f4")
    blob = b"\0" * 8 + rows.tobytes() + TETRAHEDRON.astype("<u2").tobytes()
    tree["bufferViews"][0] = {"buffer": 0, "byteOffset": 4, "byteLength": 100, "byteStride": 24}
    tree["accessors"][0]["byteOffset"] = 4
    tree["bufferViews"][1]["byteOffset"] = 8 + 96
    tree["buffers"] = [{"byteLength": len(blob)}]
    np.testing.assert_array_equal(load(tmp_path, tree, blob).vertices, FAN_POINTS)


def test_sparse_data(tmp_path):
    tree, blob = gltf([PART])
    blob += struct.pack("<2H", 1, 3) + np.array([[5, 0, 0], [0, 0, 6]], "<f4").tobytes()
    start = len(blob) - 28
    tree["bufferViews"] += [
        {"buffer": 0, "byteOffset": start, "byteLength": 4},
        {"buffer": 0, "byteOffset": start + 4, "byteLength": 24},
    ]
    tree["accessors"][0]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": 2, "componentType": 5123},
        "values": {"bufferView": 3},
    }
    tree["buffers"] = [{"byteLength": len(blob)}]
    mesh = load(tmp_path, tree, blob)
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [5, 0, 0], [0, 1, 0], [0, 0, 6]])


def external(tmp_path, uri: str) -> Mesh:
    folder = tmp_path / "model"
    folder.mkdir(exist_ok=True)
    tree, blob = gltf([PART])
    for place in (tmp_path / "secret.bin", folder / "data one.bin"):
        place.write_bytes(blob)
    tree["buffers"][0]["uri"] = uri
    (folder / "a.gltf").write_text(json.dumps(tree))
    return Mesh.load(folder / "a.gltf")


def test_buffers_beside_the_file(tmp_path):
    assert len(external(tmp_path, "data%20one.bin").faces) == 4
    assert len(external(tmp_path, "./data one.bin").faces) == 4
    embedded = base64.b64encode(gltf([PART])[1]).decode()
    assert len(external(tmp_path, f"data:application/octet-stream;base64,{embedded}").faces) == 4


@pytest.mark.parametrize(
    ("uri", "words"),
    [
        ("../secret.bin", "outside its folder"),
        ("%2e%2e/secret.bin", "outside its folder"),
        ("{root}/secret.bin", "outside its folder"),
        ("file://{root}/secret.bin", "outside its folder"),
        ("https://example.org/data.bin", "outside its folder"),
        ("link.bin", "outside its folder"),
        ("none.bin", "does not exist"),
        (".", "does not exist"),
        ("a\0b", "cannot be read"),
        ("data:application/octet-stream;base64,!!!", "damaged embedded buffer"),
        ("data:application/octet-stream;base64,AAAA", "cut off"),
    ],
)
def test_buffers_elsewhere_are_not_opened(uri, words, tmp_path):
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "link.bin").symlink_to(tmp_path / "secret.bin")
    with pytest.raises(MeshError) as error:
        external(tmp_path, uri.replace("{root}", str(tmp_path)))
    assert words in error.value.problem


def edit(path: str, value):
    """A change of the tree at a path like "accessors.0.count"."""

    def change(tree):
        *parents, last = [int(k) if k.isdigit() else k for k in path.split(".")]
        place = tree
        for key in parents:
            place = place[key]
        place[last] = value

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (edit("asset.version", "1.0"), "version 1.0"),
        (edit("extensionsRequired", ["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
        (edit("extensionsRequired", ["EXT_meshopt_compression"]), "EXT_meshopt_compression"),
        (edit("extensionsRequired", None), "not valid glTF"),
        (edit("accessors.0.count", 5), "beyond its buffer"),
        (edit("accessors.0.count", 10**12), "1,000,000,000,000 vertices"),
        (edit("accessors.1.count", 10**12), "1,000,000,000,000 corners"),
        (edit("accessors.1.count", math.inf), "not valid glTF"),
        (edit("accessors.0.componentType", 1), "not valid glTF"),
        (edit("accessors.0.bufferView", 7), "not valid glTF"),
        (edit("accessors.0.bufferView", None), "not valid glTF"),
        (edit("bufferViews.0.byteOffset", -4), "negative offset"),
        (edit("bufferViews.0.byteStride", 4), "too small stride"),
        (edit("bufferViews.0.buffer", 1), "not valid glTF"),
        (edit("buffers.0.byteLength", 10**6), "cut off"),
        (edit("meshes.0.primitives.0.attributes", {}), "not valid glTF"),
        (edit("meshes.0.primitives", None), "not valid glTF"),
        (edit("meshes.0.primitives.0.mode", 0), "no vertices"),
        (edit("nodes", []), "no vertices"),
        (edit("nodes", {}), "no vertices"),
        (edit("nodes", [{"mesh": 3}]), "not valid glTF"),
        (edit("nodes", [{"mesh": 0, "matrix": [1, 2]}]), "not valid glTF"),
        (edit("nodes", [{"mesh": 0, "scale": [math.nan, 1, 1]}]), "NaN"),
        (edit("scenes", [{"nodes": [5]}]), "not valid glTF"),
    ],
)
def test_refuses_trees(change, words, tmp_path):
    tree, blob = gltf([PART])
    change(tree)
    with pytest.raises(MeshError) as error:
        load(tmp_path, tree, blob)
    assert words in error.value.problem


def test_refuses_loops_of_nodes(tmp_path):
    tree, blob = gltf([PART], [{"mesh": 0, "children": [1]}, {"children": [0]}], scenes=[{"nodes": [0]}])
    with pytest.raises(MeshError, match="two parents"):
        load(tmp_path, tree, blob)


def test_refuses_indices_out_of_range(tmp_path):
    with pytest.raises(MeshError, match="refers to vertex 4"):
        load(tmp_path, *gltf([{**PART, "indices": TETRAHEDRON + 1}]))


def test_budget_counts_instances(tmp_path):
    tree, blob = gltf([PART], [{"mesh": 0, "translation": [9 * k, 0, 0]} for k in range(10)])
    with pytest.raises(MeshError, match="40 vertices, more than the budget of 39"):
        load(tmp_path, tree, blob, max_vertices=39)


@pytest.mark.parametrize("keep", [2, 11, 19, 60, 400, -1])
def test_refuses_files_that_are_cut(keep, tmp_path):
    path = tmp_path / "a.glb"
    path.write_bytes(glb_bytes(*gltf([PART]))[:keep])
    with pytest.raises(MeshError):
        Mesh.load(path)


def test_refuses_the_old_container(tmp_path):
    path = tmp_path / "a.glb"
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 1, 100, 50, 0) + b" " * 80)
    with pytest.raises(MeshError, match="version 1"):
        Mesh.load(path)


@pytest.mark.parametrize("scale", [[1, 1, 1], [2, 1, 1], [-1, 1, 3], [-2, -1, -1]])
def test_normals_follow_their_nodes(scale, tmp_path):
    half = math.sqrt(0.5)
    points, normals = (
        OCTAHEDRON_POINTS[OCTAHEDRON].reshape(-1, 3),
        np.sign(OCTAHEDRON_POINTS[OCTAHEDRON].sum(axis=1)),
    )
    normals = np.repeat(normals, 3, axis=0) / math.sqrt(3.0)
    node = {"mesh": 0, "scale": scale, "rotation": [0, half, 0, half], "translation": [3, 4, 5]}
    mesh = load(tmp_path, *gltf([{"positions": points, "normals": normals}], [node]))
    assert mesh.corner_normals is not None
    np.testing.assert_allclose(mesh.corner_normals, np.repeat(mesh.face_normals[:, None], 3, 1), atol=1e-6)


def test_normals_of_some_parts_only_are_left_out(tmp_path):
    far = {"positions": FAN_POINTS + 5.0, "indices": TETRAHEDRON}
    near = {**PART, "normals": np.tile([1.0, 0.0, 0.0], (4, 1))}
    with pytest.warns(MeshWarning) as record:
        mesh = load(tmp_path, *gltf([near, far]))
    assert any("only some parts have normals" in str(w.message) for w in record)
    assert mesh.corner_normals is None
