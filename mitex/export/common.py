"""What the file formats share: PNG bytes, and values of a texture at the vertices."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from mitex import __version__
from mitex.asset import Asset
from mitex.atlas import Atlas
from mitex.errors import MeshError
from mitex.geometry.normal_maps import decode, encode
from mitex.geometry.tangents import split_at_seams
from mitex.geometry.vectors import orthonormal, scatter_add
from mitex.images import bilinear
from mitex.mesh import Mesh

GENERATOR = "Mitex"
REMEDY = "give an asset that Mitex exported, or use the file as a mesh"  # of a file that is none


def foreign(path: object, what: str = "was not written by Mitex") -> MeshError:
    """The error for a file that is damaged or comes from elsewhere."""
    return MeshError(f"{path} {what}", REMEDY)


def plain_name(name: str) -> str:
    """A file name part without spaces and specials, which material files cannot quote."""
    return re.sub(r"[^\w.-]+", "_", name).strip(".") or "asset"


def png(image: np.ndarray, bits: int = 8) -> bytes:
    """An (H, W, 1 or 3) image in [0, 1] as PNG that names us as its `Software`; 16 bits for one channel."""
    pixels = np.round(image * (2.0**bits - 1)).astype(np.uint8 if bits == 8 else np.uint16)
    buffer, mark = io.BytesIO(), PngInfo()
    mark.add_text("Software", f"{GENERATOR} {__version__}")
    picture = Image.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels)
    picture.save(buffer, "PNG", pnginfo=mark)
    return buffer.getvalue()


def is_png_of_ours(path: Path) -> bool:
    """Whether a file is a PNG that `png` made, and that no other program has saved since."""
    try:
        with Image.open(path, formats=("PNG",)) as image:
            return str(image.info.get("Software", "")).startswith(f"{GENERATOR} ")
    except Exception:  # decoders raise anything on hostile bytes
        return False


def asset_from_textures(mesh: Mesh, uv: np.ndarray, textures: Mapping[str, np.ndarray], name: str) -> Asset:
    """An asset from texture maps in the atlas' frame, sampled at the vertices.

    Args:
        mesh: F faces.
        uv: (F, 3, 2), v upwards.
        textures: name -> (N, N, c) in [0, 1]; normals in the frame of `split_at_seams(mesh, uv)`.
        name: of the asset.
    """
    atlas = Atlas.from_uv(uv, next(iter(textures.values())).shape[0])
    split = split_at_seams(mesh, uv)
    # The mean over the seam's sides; without seams each vertex has one.
    copies = np.bincount(split.source, minlength=len(mesh.vertices))
    sampled = {k: bilinear(v, split.uv) for k, v in textures.items()}
    tangents = default_tangents(mesh)
    if "normal" in sampled:
        normals = split.normals
        detail = decode(sampled["normal"], split.tangents[:, :3], split.bitangents, normals)
        t = orthonormal(tangents[split.source], normals)
        sampled["normal"] = encode(detail, t, np.cross(normals, t), normals)
    maps = {}
    for key, values in sampled.items():
        maps[key] = scatter_add(split.source, values, len(copies)) / np.maximum(copies, 1)[:, None]
    return Asset(mesh, maps, tangents, atlas, textures, name)


def default_tangents(mesh: Mesh) -> np.ndarray:
    """(V, 3) unit tangents across the normals; any will do where normals are encoded anew."""
    return orthonormal(np.broadcast_to(np.array([1, 0, 0], np.float32), mesh.normals.shape), mesh.normals)
