"""An asset as a page: the same light and hands, without anything that grows."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mitex.asset import DEFAULT_ALBEDO, DEFAULT_ROUGHNESS, Asset
from mitex.colour import linear_to_srgb
from mitex.geometry.normal_maps import decode
from mitex.geometry.tangents import split_at_hard_edges
from mitex.images import to_bytes
from mitex.page.content import Content, jpeg
from mitex.page.packing import packed
from mitex.page.surface import mesh_data

EDGE = 0.04  # mean length of the mesh's edges in the page's own units; any will do
QUALITY = 90  # of the images (WebP)
ROW = {"occlusion": "ambient_occlusion", "roughness": "roughness", "height": "height"}


def write_still(asset: Asset, path: Path) -> Path:
    """Writes an asset as one HTML file that any browser with WebGL2 shows.

    Raises:
        OutputError: the place is not writable.
        MeshError: the mesh has no faces.
    """
    return still_content(asset).write(path)


def still_content(asset: Asset) -> Content:
    """What the page of an asset shows.

    Raises:
        MeshError: the mesh has no faces.
    """
    return Content(asset.name, still_data(asset), _portrait(asset))


def still_data(asset: Asset) -> dict[str, Any]:
    """An asset as JSON values: its textures, with normals in object space, or its values at the vertices."""
    data = {
        "name": asset.mesh.name,
        "look": asset.name,
        "edge": EDGE,
        "mesh": mesh_data(asset.mesh, 0),
        "maps": {name: True for name in asset.maps},
    }
    if asset.atlas is None:
        rows = {name: to_bytes(values) for name, values in _vertex_images(asset).items()}
        return data | {"rows": {name: packed(values) for name, values in rows.items()}}
    images = {name: _webp(values) for name, values in _images(asset).items()}
    uv = np.round(asset.atlas.uv.astype(np.float64) * 65535).astype(np.uint16)
    return data | {"images": images, "uv": packed(uv)}


def _vertex_images(asset: Asset) -> dict[str, np.ndarray]:
    images = _plain(asset.vertex_maps, (len(asset.mesh.vertices),))
    if "normal" in asset.vertex_maps:
        images["details"] = 0.5 + 0.5 * asset.detail_normals()
    return images


def _images(asset: Asset) -> dict[str, np.ndarray]:
    assert asset.atlas is not None and asset.texture_maps is not None
    images = _plain(asset.texture_maps, asset.atlas.face.shape)
    if "normal" in asset.texture_maps:
        frames = asset.atlas.shading_frames(asset.mesh)
        images["details"] = 0.5 + 0.5 * decode(asset.texture_maps["normal"], *frames)
    elif asset.mesh.corner_normals is not None:
        split = split_at_hard_edges(asset.mesh)
        images["details"] = 0.5 + 0.5 * asset.atlas.interpolate(split.normals[split.faces])
    return images


def _plain(maps: Any, shape: tuple[int, ...]) -> dict[str, np.ndarray]:
    """Colours (..., 3), and occlusion, roughness and height (..., 3)."""
    grey = np.full((*shape, 3), linear_to_srgb(np.float32(DEFAULT_ALBEDO)), np.float32)
    default = {"ambient_occlusion": 1.0, "roughness": DEFAULT_ROUGHNESS, "height": 0.5}
    rows = [maps.get(name, np.full((*shape, 1), default[name], np.float32)) for name in ROW.values()]
    return {"colours": maps.get("albedo", grey), "materials": np.concatenate(rows, axis=-1)}


def _webp(image: np.ndarray) -> dict[str, str]:
    buffer = io.BytesIO()
    Image.fromarray(to_bytes(image)).save(buffer, "WEBP", quality=QUALITY, method=4)
    return packed(np.frombuffer(buffer.getvalue(), np.uint8))


def _portrait(asset: Asset) -> bytes:
    """For browsers without WebGL2: the colours of the asset, and no more."""
    colours = _plain(asset.vertex_maps, (len(asset.mesh.vertices),))["colours"]
    return jpeg(np.broadcast_to(colours.mean(axis=0), (64, 64, 3)))
