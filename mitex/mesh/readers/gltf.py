"""glTF 2.0: .glb and .gltf, geometry only.

Read here and not through trimesh, because trimesh 5.2 decodes all images, drops the UVs of parts without
material, and reads sparse accessors as zeros. Nothing outside the file's folder is ever opened.
"""

from __future__ import annotations

import base64
import binascii
import json
import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import numpy as np

from mitex.errors import MeshError
from mitex.mesh.readers.budget import Budget
from mitex.mesh.readers.soup import DAMAGED, Soup, check_indices
from mitex.reading import content

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
COMPRESSIONS = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
TRIANGLES, STRIP, FAN = 4, 5, 6
READ = ("POSITION", "NORMAL", "TEXCOORD_0")  # attributes


def read_gltf(name: str, data: bytes, budget: Budget, folder: Path) -> Soup:
    """Reads the default scene, or all root nodes where none is named, with the transforms of its nodes.

    Args:
        name: for messages.
        data: the file.
        budget: of all instances together.
        folder: where relative buffer paths start, and which they must not leave.

    Raises:
        MeshError: not glTF 2.0, compressed geometry, damaged or missing data, a path outside `folder`, more
            than the budget.
        LookupError, TypeError, ValueError, OverflowError, AttributeError: not valid glTF.
    """
    tree, chunk = _container(name, data)
    version = str(tree.get("asset", {}).get("version", "?"))
    if not version.startswith("2"):
        raise MeshError(f"{name} is glTF version {version}", "export it as glTF 2.0")
    required = tree.get("extensionsRequired", [])
    for extension in COMPRESSIONS:
        if extension in required:
            raise MeshError(f"{name} is compressed with {extension}", "export it without mesh compression")
    meshes = [_triangle_primitives(mesh) for mesh in tree.get("meshes", [])]
    placed = list(_placed(tree))
    _check_budget(name, tree, [meshes[mesh] for mesh, _ in placed], budget)
    source = _Accessors(tree, _buffers(name, tree, chunk, folder, budget.bytes))
    return _join(name, [(source, primitive, matrix) for mesh, matrix in placed for primitive in meshes[mesh]])


def _container(name: str, data: bytes) -> tuple[dict[str, Any], bytes | None]:
    """The JSON tree, and the binary chunk of a .glb."""
    chunk = None
    text = data
    if data.startswith(b"glTF"):
        if len(data) < 20:
            raise MeshError(f"{name} is cut off", DAMAGED)
        _, version, length, size, kind = struct.unpack_from("<4sIII4s", data)
        if version == 2 and (kind != b"JSON" or length > len(data) or 20 + size > len(data)):
            raise MeshError(f"{name} is cut off or damaged: {len(data)} of {length} bytes", DAMAGED)
        if version != 2:
            raise MeshError(f"{name} is glTF version {version}", "export it as glTF 2.0")
        text = data[20 : 20 + size]
        if len(data) >= 28 + size:
            (size_2,) = struct.unpack_from("<I", data, 20 + size)
            chunk = data[28 + size : 28 + size + size_2]
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MeshError(f"{name} is not a glTF file", "check its suffix and how it was exported") from error
    if not isinstance(tree, dict) or not isinstance(tree.get("asset"), dict):
        raise MeshError(f"{name} is not a glTF file", "check its suffix and how it was exported")
    return tree, chunk


def _buffers(name: str, tree: dict, chunk: bytes | None, folder: Path, max_bytes: int) -> list[bytes]:
    buffers, fetched = [], {}
    for number, buffer in enumerate(tree.get("buffers", [])):
        uri = buffer.get("uri")
        if uri in fetched:
            blob = fetched[uri]
        elif uri is not None:
            blob = fetched[uri] = _fetch(name, uri, folder, max_bytes)
            max_bytes -= len(blob)
        elif number == 0 and chunk is not None:
            blob = chunk
        else:
            raise MeshError(f"{name} has no data for buffer {number}", DAMAGED)
        if len(blob) < buffer["byteLength"]:
            raise MeshError(f"buffer {number} of {name} is cut off", DAMAGED)
        buffers.append(blob)
    return buffers


def _fetch(name: str, uri: str, folder: Path, max_bytes: int) -> bytes:
    """The bytes behind a data URI or a relative path."""
    if uri.startswith("data:"):
        try:
            return base64.b64decode(uri.partition("base64,")[2], validate=True)
        except binascii.Error as error:
            raise MeshError(f"{name} has a damaged embedded buffer", DAMAGED) from error
    excerpt = uri[:80]
    remedy = "keep the buffers beside the .gltf file, or export a .glb"
    root = folder.resolve()
    try:
        path = (root / unquote(uri)).resolve()
        if urlsplit(uri).scheme or not path.is_relative_to(root):
            raise MeshError(f"{name} refers to '{excerpt}', which is outside its folder", remedy)
        if not path.is_file():
            raise MeshError(f"{name} refers to '{excerpt}', which does not exist", remedy)
        if path.stat().st_size > max_bytes:
            raise MeshError(f"the buffer '{excerpt}' of {name} is too large", "simplify the mesh")
        return content(path, max_bytes)
    except (OSError, ValueError) as error:
        raise MeshError(f"{name} refers to '{excerpt}', which cannot be read", remedy) from error


def _triangle_primitives(mesh: dict[str, Any]) -> list[dict[str, Any]]:
    return [p for p in mesh["primitives"] if p.get("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN)]


def _check_budget(name: str, tree: dict[str, Any], placed: list[list[dict]], budget: Budget) -> None:
    """Refuses a scene of meshes, each with its primitives, before they are multiplied."""
    budget.check(name, instances=sum(map(len, placed)))
    vertices = corners = 0
    for primitives in placed:
        for primitive in primitives:
            counts = {k: _count(tree, index) for k, index in primitive["attributes"].items() if k in READ}
            if set(counts.values()) != {counts["POSITION"]}:
                raise ValueError(f"attributes of {counts} elements")
            vertices += counts["POSITION"]
            corners += _count(tree, primitive["indices"]) if "indices" in primitive else counts["POSITION"]
            budget.check(name, vertices=vertices, corners=corners)


def _count(tree: dict[str, Any], accessor: int) -> int:
    count = tree["accessors"][accessor]["count"]
    if not isinstance(count, int) or count < 0:
        raise ValueError(f"an accessor of {count} elements")
    return count


def _placed(tree: dict[str, Any]) -> Iterator[tuple[int, np.ndarray]]:
    """Yields (mesh, 4x4 matrix) of every node in the scene that has a mesh."""
    nodes = tree.get("nodes", [])
    scenes = tree.get("scenes", [])
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [n for n in range(len(nodes)) if n not in children]
    if scenes:
        roots = scenes[tree.get("scene", 0)].get("nodes", [])
    stack = [(root, np.eye(4)) for root in reversed(roots)]
    visited = set()
    while stack:
        index, parent = stack.pop()
        if index in visited:
            raise ValueError(f"node {index} has two parents")
        visited.add(index)
        node = nodes[index]
        matrix = parent @ _matrix(node)
        stack.extend((child, matrix) for child in reversed(node.get("children", [])))
        if "mesh" in node:
            yield node["mesh"], matrix


def _matrix(node: dict) -> np.ndarray:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64)
    length = math.sqrt(x * x + y * y + z * z + w * w) or 1.0
    x, y, z, w = x / length, y / length, z / length, w / length
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


@dataclass
class _Accessors:
    """Typed views of the buffers."""

    tree: dict
    buffers: list[bytes]

    def __getitem__(self, index: int) -> np.ndarray:
        """(count, width) numbers; normalised integers as float64 in [0, 1] or [-1, 1]."""
        accessor = self.tree["accessors"][index]
        kind, width = np.dtype(COMPONENTS[accessor["componentType"]]), WIDTHS[accessor["type"]]
        count = _count(self.tree, index)
        if "bufferView" in accessor:
            values = self._view(accessor["bufferView"], accessor.get("byteOffset", 0), kind, width, count)
        else:
            values = np.zeros((count, width), kind)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            where, what = sparse["indices"], sparse["values"]
            offset = where.get("byteOffset", 0)
            place_kind = np.dtype(COMPONENTS[where["componentType"]])
            places = self._view(where["bufferView"], offset, place_kind, 1, sparse["count"])[:, 0]
            values = values.copy()
            values[places] = self._view(
                what["bufferView"], what.get("byteOffset", 0), kind, width, sparse["count"]
            )
        if accessor.get("normalized") and kind.kind in "iu":
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values

    def _view(self, view_index: int, offset: int, kind: np.dtype, width: int, count: int) -> np.ndarray:
        view = self.tree["bufferViews"][view_index]
        start = view.get("byteOffset", 0)
        data = self.buffers[view["buffer"]][start : start + view["byteLength"]]
        row = kind.itemsize * width
        stride = view.get("byteStride", row)
        if min(start, offset, count) < 0 or stride < row:
            raise ValueError("a negative offset or too small stride")
        if count and offset + stride * (count - 1) + row > len(data):
            raise ValueError("an accessor reaches beyond its buffer")
        return np.ndarray((count, width), kind, data, offset, (stride, kind.itemsize))


def _join(name: str, parts: list[tuple[_Accessors, dict, np.ndarray]]) -> Soup:
    vertices, faces, uvs, normals, start = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], [], [], 0
    for source, primitive, matrix in parts:
        local = source[primitive["attributes"]["POSITION"]].astype(np.float64)
        triangles = _triangles(source, primitive, len(local))
        check_indices(name, triangles, len(local))
        with np.errstate(invalid="ignore"):  # a transform that is not finite is reported by its vertices
            mirrored = np.linalg.det(matrix[:3, :3]) < 0.0
        if mirrored:
            triangles = triangles[:, ::-1]
        if "TEXCOORD_0" in primitive["attributes"]:
            uv = source[primitive["attributes"]["TEXCOORD_0"]][triangles].astype(np.float64)
            uv[:, :, 1] = 1.0 - uv[:, :, 1]  # glTF counts v downwards
            uvs.append(uv)
        if "NORMAL" in primitive["attributes"]:
            normals.append(_turned(source[primitive["attributes"]["NORMAL"]], matrix)[triangles])
        vertices.append(local @ matrix[:3, :3].T + matrix[:3, 3])
        faces.append(triangles + start)
        start += len(local)
    soup = Soup(np.concatenate(vertices), np.concatenate(faces), split=True)
    soup.uv, soup.normals = (np.concatenate(a) if len(a) == len(parts) > 0 else None for a in (uvs, normals))
    for what, values in (("texture coordinates", uvs), ("normals", normals)):
        if 0 < len(values) < len(parts):
            soup.notes.append(f"only some parts have {what}, so they were left out")
    return soup


def _turned(normals: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Normals (V, 3) under a transform, of any length: times its cofactors, which reflections turn around."""
    rows = matrix[:3, :3]
    with np.errstate(invalid="ignore"):
        cofactors = np.cross(np.roll(rows, -1, axis=0), np.roll(rows, -2, axis=0))
        return normals.astype(np.float64) @ cofactors.T * np.sign(np.linalg.det(rows))


def _triangles(source: _Accessors, primitive: dict, count: int) -> np.ndarray:
    if "indices" in primitive:
        index = source[primitive["indices"]][:, 0].astype(np.int64)
    else:
        index = np.arange(count)
    mode = primitive.get("mode", TRIANGLES)
    if mode == TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    n = max(len(index) - 2, 0)
    k = np.arange(n)
    if mode == FAN:
        return np.stack([index[k + 1], index[k + 2], np.broadcast_to(index[:1], n)], axis=1)
    odd = k % 2
    return np.stack([index[k], index[k + 1 + odd], index[k + 2 - odd]], axis=1)
