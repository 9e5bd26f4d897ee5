"""glTF 2.0 binary (GLB): the mesh with PBR textures, or with vertex colours where nothing is baked.

Attributes of our own (glTF reserves the leading underscore for that) make the file an exact copy of the mesh,
but for its polygons, which glTF has not: `_VERTEX`, the vertex before splitting at UV seams and hard edges,
`_HEIGHT`, for which glTF has no texture slot, and `_SHADING_NORMAL` where NORMAL shows relief.
"""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from mitex.asset import DEFAULT_ALBEDO, DEFAULT_ROUGHNESS, Asset
from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError, OutputError
from mitex.export.common import GENERATOR, png
from mitex.export.glb_read import read_glb
from mitex.geometry.tangents import HardSplit, split_at_hard_edges, split_at_seams
from mitex.paths import atomic_write, prepare_output

__all__ = ["glb_bytes", "read_glb", "write_glb", "write_variants"]

_VECTORS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_FLOAT, _UINT32 = 5126, 5125
_VERTEX_BUFFER, _INDEX_BUFFER = 34962, 34963
_LINEAR, _MIPMAPPED, _CLAMP = 9729, 9987, 33071
LARGEST = 2**32 - 64  # [bytes]; lengths are 32-bit numbers
_VARIANTS = "KHR_materials_variants"


def write_glb(asset: Asset, path: Path) -> None:
    """Writes `glb_bytes` to a file."""
    with atomic_write(path) as temporary:
        temporary.write_bytes(glb_bytes(asset))


def glb_bytes(asset: Asset) -> bytes:
    """The asset as a GLB file.

    Baked: vertices split at UV seams and hard edges, NORMAL, TANGENT, TEXCOORD_0, and up to three PNG
    textures: base colour (sRGB), occlusion (R), roughness (G) and metallic (B = 0) in one, and normal.
    Not baked: vertices split at hard edges, COLOR_0 (linear), the detail normals as NORMAL, and all maps as
    `_NAME` attributes.
    """
    builder = _Builder()
    primitive = _primitive(asset, builder)
    return _container(_document(asset.name, primitive, [_material(asset, builder)], builder), builder.blob)


def write_variants(assets: Iterable[Asset], path: str | os.PathLike[str]) -> Path:
    """Writes several looks of one mesh as one GLB: viewers offer them by name (KHR_materials_variants), and
    others, `Asset.load` among them, show the first one.

    Args:
        assets: baked, on the same mesh and UV layout, with names of their own; they are taken one at a time.
        path: target, .glb.

    Returns:
        The path written.

    Raises:
        ConfigError: no asset, one without textures, on another mesh or layout, or a name twice.
        OutputError: wrong suffix or unwritable place, or more than 4 GB.
    """
    target, builder = prepare_output(path, (".glb",)), _Builder()
    materials: list[dict[str, Any]] = []
    first, primitive = None, {}
    for asset in assets:
        if first is None:
            first = asset
            primitive = _primitive(asset, builder)
        _check_variant(asset, first, [material["name"] for material in materials])
        materials.append(_material(asset, builder))
    if first is None:
        raise ConfigError("there are no variants to write", "give at least one asset")
    which = range(len(materials))
    primitive["extensions"] = {_VARIANTS: {"mappings": [{"material": k, "variants": [k]} for k in which]}}
    document = _document(first.mesh.name, primitive, materials, builder)
    names = [{"name": material["name"]} for material in materials]
    document |= {"extensionsUsed": [_VARIANTS], "extensions": {_VARIANTS: {"variants": names}}}
    data = _container(document, builder.blob)
    with atomic_write(target) as temporary:
        temporary.write_bytes(data)
    return target


def _check_variant(asset: Asset, first: Asset, names: list[str]) -> None:
    if asset.atlas is None or first.atlas is None:
        raise ConfigError(f"variant '{asset.name}' has no textures", "bake it first")
    if asset.name in names:
        raise ConfigError(f"there are two variants '{asset.name}'", "give each asset a name of its own")
    ours = asset.mesh.vertices, asset.mesh.faces, asset.atlas.uv
    theirs = first.mesh.vertices, first.mesh.faces, first.atlas.uv
    if not all(map(np.array_equal, ours, theirs)):
        raise ConfigError(
            f"variant '{asset.name}' is on another mesh or UV layout than '{first.name}'",
            "bake all of them on one layout",
        )


def _primitive(asset: Asset, builder: _Builder) -> dict[str, Any]:
    attributes = _baked_attributes(asset) if asset.texture_maps else _vertex_attributes(asset)
    faces = attributes.pop("faces")
    return {
        "attributes": {
            k: builder.accessor(v, _VERTEX_BUFFER, k == "POSITION") for k, v in attributes.items()
        },
        "indices": builder.accessor(faces.reshape(-1, 1).astype(np.uint32), _INDEX_BUFFER),
        "material": 0,
    }


def _material(asset: Asset, builder: _Builder) -> dict[str, Any]:
    # Both sides: open meshes (a Moebius strip has no other choice).
    look = _textured(asset, builder) if asset.texture_maps else _plain(asset)
    return {"name": asset.name, "doubleSided": True, **look}


def _document(
    name: str, primitive: dict[str, Any], materials: list[dict[str, Any]], builder: _Builder
) -> dict[str, Any]:
    return {
        "asset": {"version": "2.0", "generator": GENERATOR},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": name}],
        "meshes": [{"primitives": [primitive], "name": name}],
        "materials": materials,
        **builder.document,
    }


def _baked_attributes(asset: Asset) -> dict[str, np.ndarray]:
    assert asset.atlas is not None
    split = split_at_seams(asset.mesh, asset.atlas.uv)
    attributes = {
        "POSITION": asset.mesh.vertices[split.source],
        "NORMAL": split.normals,
        "TEXCOORD_0": np.stack([split.uv[:, 0], 1.0 - split.uv[:, 1]], axis=1),  # glTF's v points down
        "_VERTEX": _indices(split),
        "faces": split.faces,
    }
    if "normal" in (asset.texture_maps or {}):
        attributes["TANGENT"] = split.tangents
    if "height" in asset.vertex_maps:
        attributes["_HEIGHT"] = asset.vertex_maps["height"][split.source]
    return attributes


def _vertex_attributes(asset: Asset) -> dict[str, np.ndarray]:
    split = split_at_hard_edges(asset.mesh)
    maps = {k: v[split.source] for k, v in asset.vertex_maps.items()}
    attributes = {
        "POSITION": asset.mesh.vertices[split.source],
        "NORMAL": asset.detail_normals(split),
        "faces": split.faces,
    }
    if asset.mesh.corner_normals is not None:
        attributes |= {"_VERTEX": _indices(split), "_SHADING_NORMAL": split.normals}
    if "albedo" in maps:
        attributes["COLOR_0"] = srgb_to_linear(maps["albedo"])
    attributes |= {f"_{k.upper()}": v for k, v in maps.items() if k != "albedo"}
    if asset.tangents is not None:
        attributes["_TANGENT"] = asset.tangents[split.source]
    return attributes


def _indices(split: HardSplit) -> np.ndarray:
    """(N, 1) the vertices that the split ones copy; glTF has no integers of 32 bits for attributes."""
    return split.source[:, None].astype(np.float32)


def _plain(asset: Asset) -> dict[str, Any]:
    maps = asset.vertex_maps
    roughness = float(maps["roughness"].mean()) if "roughness" in maps else DEFAULT_ROUGHNESS
    grey = 1.0 if "albedo" in maps else DEFAULT_ALBEDO
    return {
        "pbrMetallicRoughness": {
            "baseColorFactor": [grey, grey, grey, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": roughness,
        }
    }


def _textured(asset: Asset, builder: _Builder) -> dict[str, Any]:
    maps = dict(asset.texture_maps or {})
    surface: dict[str, Any] = {"metallicFactor": 0.0}
    material: dict[str, Any] = {"pbrMetallicRoughness": surface}
    if "albedo" in maps:
        surface["baseColorTexture"] = {"index": builder.texture(maps["albedo"], "albedo")}
    else:
        surface["baseColorFactor"] = [DEFAULT_ALBEDO] * 3 + [1.0]
    if "roughness" in maps or "ambient_occlusion" in maps:
        size = next(iter(maps.values())).shape[:2]
        packed = np.zeros((*size, 3), np.float32)
        packed[..., :1] = maps.get("ambient_occlusion", 1.0)
        packed[..., 1:2] = maps.get("roughness", 1.0)
        index = builder.texture(packed, "occlusion_roughness_metallic")
        if "ambient_occlusion" in maps:
            material["occlusionTexture"] = {"index": index}
        if "roughness" in maps:
            surface["metallicRoughnessTexture"] = {"index": index}
    if "roughness" not in maps:
        surface["roughnessFactor"] = DEFAULT_ROUGHNESS
    if "normal" in maps:
        material["normalTexture"] = {"index": builder.texture(maps["normal"], "normal")}
    return material


class _Builder:
    """Collects the binary chunk and the JSON lists that point into it."""

    def __init__(self):
        self._parts: list[bytes] = []
        self._length = 0
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._images: list[dict[str, Any]] = []

    def accessor(self, values: np.ndarray, target: int, bounds: bool = False) -> int:
        """Adds (N, c) vertex attributes (float32) or (N, 1) indices (uint32)."""
        kind, dtype = (_UINT32, "<u4") if values.dtype == np.uint32 else (_FLOAT, "<f4")
        data = np.ascontiguousarray(values, dtype)
        entry = {
            "bufferView": self._view(data.tobytes(), target=target),
            "componentType": kind,
            "count": len(data),
            "type": _VECTORS[data.shape[1]],
        }
        if bounds:
            entry |= {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
        self._accessors.append(entry)
        return len(self._accessors) - 1

    def texture(self, image: np.ndarray, name: str) -> int:
        """Adds an (H, W, c) image in [0, 1] as PNG."""
        self._images.append({"bufferView": self._view(png(image)), "mimeType": "image/png", "name": name})
        return len(self._images) - 1

    def _view(self, data: bytes, **more: int) -> int:
        self._views.append({"buffer": 0, "byteOffset": self._length, "byteLength": len(data), **more})
        padded = data + b"\0" * (-len(data) % 4)
        self._parts.append(padded)
        self._length += len(padded)
        return len(self._views) - 1

    @property
    def blob(self) -> bytes:
        return b"".join(self._parts)

    @property
    def document(self) -> dict[str, Any]:
        lists: dict[str, Any] = {
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": self._length}],
        }
        if self._images:
            sampler = {"magFilter": _LINEAR, "minFilter": _MIPMAPPED, "wrapS": _CLAMP, "wrapT": _CLAMP}
            lists |= {
                "images": self._images,
                "samplers": [sampler],
                "textures": [{"sampler": 0, "source": k} for k in range(len(self._images))],
            }
        return lists


def _container(document: dict[str, Any], blob: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False).encode()
    text += b" " * (-len(text) % 4)
    if len(text) + len(blob) >= LARGEST:
        raise OutputError(
            f"a GLB of {(len(text) + len(blob)) / 1e9:.1f} GB is not possible",
            "use fewer or smaller textures; 4 GB is the format's limit",
        )
    chunks = (
        struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
