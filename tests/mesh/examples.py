"""Small meshes, hypothesis strategies and file writers for the tests of meshes."""

import json
import struct
from typing import Any

import numpy as np
import trimesh
from hypothesis import strategies as st

from mitex.mesh import Mesh
from mitex.mesh.frames import interpolate_frames, vertex_directions

# One corner of a cube and a bit more: three triangles around vertex 0, open.
FAN = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]])
FAN_POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
OCTAHEDRON_POINTS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
OCTAHEDRON = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
)


def tangent_frames(
    mesh: Mesh,
    face: np.ndarray,
    barycentric: np.ndarray,
    kind: str = "smooth",
    angle: float = 0.0,
    field: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Right and up at points of the surface, from the directions of its vertices."""
    return interpolate_frames(mesh, face, barycentric, vertex_directions(mesh, kind, field), angle)


def tetrahedron() -> Mesh:
    return Mesh(FAN_POINTS, TETRAHEDRON, name="tetrahedron")


def octahedron() -> Mesh:
    return Mesh(OCTAHEDRON_POINTS, OCTAHEDRON, name="octahedron")


@st.composite
def meshes(draw, max_vertices: int = 12, max_faces: int = 20) -> Mesh:
    """Any triangles between a few vertices: boundaries, non-manifold edges, unused vertices, components."""
    count = draw(st.integers(3, max_vertices))
    triples = st.lists(st.integers(0, count - 1), min_size=3, max_size=3, unique=True)
    faces = draw(st.lists(triples, min_size=1, max_size=max_faces))
    seed = draw(st.integers(0, 2**32 - 1))
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return Mesh(points, np.array(faces))


def obj_text(mesh: Mesh) -> str:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.astype(float).tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    return "\n".join(lines) + "\n"


def exported_by_trimesh(mesh: Mesh, kind: str, **options) -> Any:
    """The bytes of a file; for glTF a dict of them."""
    data = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type=kind, **options)
    return data.encode() if isinstance(data, str) else data


def ply_bytes(vertices, faces, order="<", columns=("x", "y", "z"), face_count=None) -> bytes:
    """Binary PLY of float columns and polygons."""
    vertices = np.asarray(vertices, f"{order}f4")
    header = f"ply\nformat binary_{'little' if order == '<' else 'big'}_endian 1.0\ncomment test\n"
    header += f"element vertex {len(vertices)}\n" + "".join(f"property float {c}\n" for c in columns)
    header += f"element face {len(faces) if face_count is None else face_count}\n"
    header += "property list uchar int vertex_indices\nend_header\n"
    rows = b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces)
    return header.encode() + vertices.tobytes() + rows


def gltf(parts, nodes=None, **extra):
    """A glTF tree and its buffer.

    Args:
        parts: one dict per mesh: `positions`, optional `indices`, `normals`, `uv`, `mode`.
        nodes: the nodes; one per mesh, untransformed, if None.
        extra: more entries of the tree.
    """
    blob, views, accessors, primitives = b"", [], [], []

    def add(array, kind):
        nonlocal blob
        array = np.asarray(array)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        code = {"f4": 5126, "u4": 5125, "u2": 5123, "u1": 5121}[array.dtype.str[1:]]
        accessor: dict[str, Any] = {
            "bufferView": len(views) - 1,
            "componentType": code,
            "count": len(array),
            "type": kind,
            "normalized": kind != "SCALAR" and code != 5126,
        }
        accessors.append(accessor)
        data = array.tobytes()
        blob += data + b"\0" * (-len(data) % 4)
        return len(accessors) - 1

    for part in parts:
        primitive: dict[str, Any] = {
            "attributes": {"POSITION": add(np.asarray(part["positions"], np.float32), "VEC3")}
        }
        if "indices" in part:
            primitive["indices"] = add(np.asarray(part["indices"], np.uint16).ravel(), "SCALAR")
        if "normals" in part:
            primitive["attributes"]["NORMAL"] = add(np.asarray(part["normals"], np.float32), "VEC3")
        if "uv" in part:
            primitive["attributes"]["TEXCOORD_0"] = add(part["uv"], "VEC2")
        if "mode" in part:
            primitive["mode"] = part["mode"]
        primitives.append(primitive)
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [p]} for p in primitives],
        "nodes": [{"mesh": k} for k in range(len(parts))] if nodes is None else nodes,
        **extra,
    }
    return tree, blob


def glb_bytes(tree, blob: bytes) -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
