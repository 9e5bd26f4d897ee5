"""Reading back GLB files that Mitex wrote; every index and size in them is checked."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mitex.asset import Asset
from mitex.colour import linear_to_srgb
from mitex.exemplar import MAPS
from mitex.export.common import GENERATOR, asset_from_textures, foreign
from mitex.images import MAX_PIXELS
from mitex.mesh import Mesh

_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_DTYPES = {5126: "<f4", 5125: "<u4"}


def read_glb(path: Path) -> Asset:
    """Reads what `write_glb` wrote, with the vertices as they were before splitting.

    Raises:
        MeshError: damaged, or not written by Mitex.
    """
    document, blob = _chunks(path.read_bytes(), path)
    if document["asset"]["generator"] != GENERATOR:
        raise foreign(path)
    return _asset(document, blob, path)


def _chunks(data: bytes, path: Path) -> tuple[dict[str, Any], bytes]:
    if data[:4] != b"glTF":
        raise foreign(path, "is not a GLB file")
    _, version, length = struct.unpack_from("<4sII", data)
    if version != 2 or length != len(data):
        raise foreign(path, "is cut short" if length > len(data) else "is not a glTF 2.0 file")
    size, _ = struct.unpack_from("<II", data, 12)
    return json.loads(data[20 : 20 + size]), data[20 + size + 8 :]


def _asset(document: dict[str, Any], blob: bytes, path: Path) -> Asset:
    def view(index: int) -> bytes:
        entry = document["bufferViews"][index]
        start, length = entry["byteOffset"], entry["byteLength"]
        if start < 0 or length < 0 or start + length > len(blob):
            raise foreign(path, "is cut short")
        return blob[start : start + length]

    def array(index: int) -> np.ndarray:
        entry = document["accessors"][index]
        values = np.frombuffer(view(entry["bufferView"]), _DTYPES[entry["componentType"]])
        return values.reshape(entry["count"], _WIDTHS[entry["type"]])

    primitive = document["meshes"][0]["primitives"][0]
    attributes = {k: array(i) for k, i in primitive["attributes"].items()}
    faces = array(primitive["indices"]).reshape(-1, 3)
    name = document["nodes"][0]["name"]
    if "TEXCOORD_0" not in attributes:
        return _from_vertices(attributes, faces, name)
    textures = _textures(document, view)
    uv = np.array([0, 1], np.float32) + attributes["TEXCOORD_0"][faces] * np.array([1, -1], np.float32)
    mesh, source, _ = _unsplit(attributes, faces, attributes["NORMAL"], name)
    mesh = replace(mesh, uv=uv)
    height = None
    if "_HEIGHT" in attributes:
        height = np.zeros((len(mesh.vertices), 1), np.float32)
        height[source] = attributes["_HEIGHT"]
        if not textures:
            return Asset(mesh, {"height": height}, name=name)
    asset = asset_from_textures(mesh, uv, textures, name)
    return asset if height is None else _with_height(asset, height)


def _from_vertices(attributes: dict[str, np.ndarray], faces: np.ndarray, name: str) -> Asset:
    maps = {k: attributes[f"_{k.upper()}"] for k in MAPS if f"_{k.upper()}" in attributes}
    if "COLOR_0" in attributes:
        maps["albedo"] = linear_to_srgb(attributes["COLOR_0"])
    tangents = attributes.get("_TANGENT")
    if "_VERTEX" not in attributes:
        return Asset(
            Mesh(attributes["POSITION"], faces.astype(np.int64), name=name), maps, tangents, name=name
        )
    mesh, _, first = _unsplit(attributes, faces, attributes["_SHADING_NORMAL"], name)
    maps, tangents = {k: v[first] for k, v in maps.items()}, None if tangents is None else tangents[first]
    return Asset(mesh, maps, tangents, name=name)


def _unsplit(
    attributes: dict[str, np.ndarray], faces: np.ndarray, normals: np.ndarray, name: str
) -> tuple[Mesh, np.ndarray, np.ndarray]:
    """The mesh before splitting, its vertices among the N split ones (N,), and one of those for each (V,)."""
    # Vertices that no face uses are not in the file: number the others without gaps.
    _, first, source = np.unique(attributes["_VERTEX"][:, 0], return_index=True, return_inverse=True)
    mesh = Mesh(attributes["POSITION"][first], source[faces].astype(np.int64), name=name)
    return mesh.with_shading_normals(normals[faces]), source, first


def _textures(document: dict[str, Any], view: Callable[[int], bytes]) -> dict[str, np.ndarray]:
    def pixels(reference: dict[str, Any]) -> np.ndarray:
        entry = document["images"][document["textures"][reference["index"]]["source"]]
        with Image.open(io.BytesIO(view(entry["bufferView"])), formats=("PNG",)) as image:
            if image.width * image.height > MAX_PIXELS:
                raise ValueError("texture too large")
            return np.asarray(image.convert("RGB"), np.float32) / np.float32(255.0)

    material = document["materials"][0]
    surface = material["pbrMetallicRoughness"]
    textures = {}
    if "baseColorTexture" in surface:
        textures["albedo"] = pixels(surface["baseColorTexture"])
    if "metallicRoughnessTexture" in surface:
        textures["roughness"] = pixels(surface["metallicRoughnessTexture"])[..., 1:2]
    if "occlusionTexture" in material:
        textures["ambient_occlusion"] = pixels(material["occlusionTexture"])[..., 0:1]
    if "normalTexture" in material:
        textures["normal"] = pixels(material["normalTexture"])
    return textures


def _with_height(asset: Asset, height: np.ndarray) -> Asset:
    assert asset.atlas is not None
    textures = {**(asset.texture_maps or {}), "height": asset.atlas.interpolate(height[asset.mesh.faces])}
    return replace(asset, vertex_maps={**asset.vertex_maps, "height": height}, texture_maps=textures)
