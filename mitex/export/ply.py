"""PLY: binary, 8-bit vertex colours that every tool shows, the other maps as float properties."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitex.asset import Asset
from mitex.export.common import GENERATOR, foreign
from mitex.mesh import Mesh
from mitex.paths import atomic_write

# Property names of the float maps; albedo is red, green, blue.
_FLOATS = {
    "ambient_occlusion": ("ambient_occlusion",),
    "height": ("height",),
    "normal": ("normal_map_x", "normal_map_y", "normal_map_z"),
    "roughness": ("roughness",),
}
_TANGENT = ("tangent_x", "tangent_y", "tangent_z")
_TYPES = {"float": "<f4", "uchar": "u1"}
_FACE = np.dtype([("count", "u1"), ("vertex_indices", "<i4", (3,))])


def write_ply(asset: Asset, path: Path) -> None:
    """Writes the mesh with its vertex maps: albedo as uchar sRGB, all others as float in [0, 1]."""
    mesh = asset.mesh
    columns = dict(zip(("x", "y", "z", "nx", "ny", "nz"), (*mesh.vertices.T, *mesh.normals.T), strict=True))
    if asset.tangents is not None:
        columns |= dict(zip(_TANGENT, asset.tangents.T, strict=True))
    for name, properties in _FLOATS.items():
        if name in asset.vertex_maps:
            columns |= dict(zip(properties, asset.vertex_maps[name].T, strict=True))
    colours = {}
    if "albedo" in asset.vertex_maps:
        rgb = np.round(asset.vertex_maps["albedo"] * 255.0).astype(np.uint8)
        colours = dict(zip(("red", "green", "blue"), rgb.T, strict=True))
    dtype = np.dtype([(k, "<f4") for k in columns] + [(k, "u1") for k in colours])
    vertices = np.empty(len(mesh.vertices), dtype)
    for key, values in (columns | colours).items():
        vertices[key] = values
    faces = np.empty(len(mesh.faces), _FACE)
    faces["count"], faces["vertex_indices"] = 3, mesh.faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {GENERATOR}; maps in [0, 1], colours sRGB",
        f"element vertex {len(vertices)}",
        *(f"property float {k}" for k in columns),
        *(f"property uchar {k}" for k in colours),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        file.write("\n".join(header).encode())
        file.write(vertices.tobytes())
        file.write(faces.tobytes())


def read_ply(path: Path) -> Asset:
    """Reads what `write_ply` wrote.

    Raises:
        MeshError: damaged, or not written by Mitex.
    """
    data = path.read_bytes()
    end = data[:4096].find(b"end_header\n")
    lines = data[: max(end, 0)].decode("ascii", "replace").split("\n")
    own = lines[:2] == ["ply", "format binary_little_endian 1.0"] and GENERATOR in "".join(lines[2:3])
    if end < 0 or not own:
        raise foreign(path)
    try:
        dtype = np.dtype(
            [(w[2], _TYPES[w[1]]) for w in map(str.split, lines) if w[:1] == ["property"] and len(w) == 3]
        )
        count, faces = (int(w[2]) for w in map(str.split, lines) if w[:1] == ["element"])
        body = end + len("end_header\n")
        if min(count, faces) < 0 or len(data) - body != count * dtype.itemsize + faces * _FACE.itemsize:
            raise foreign(path, "is cut short")
        vertices = np.frombuffer(data, dtype, count, body)
        corners = np.frombuffer(data, _FACE, faces, body + vertices.nbytes)
        names = dtype.names or ()
        mesh = Mesh(_columns(vertices, ("x", "y", "z")), corners["vertex_indices"], name=path.stem)
        maps = {k: _columns(vertices, p) for k, p in _FLOATS.items() if p[0] in names}
        if "red" in names:
            maps["albedo"] = _columns(vertices, ("red", "green", "blue")) / np.float32(255.0)
        tangents = _columns(vertices, _TANGENT) if _TANGENT[0] in names else None
    except (KeyError, ValueError, IndexError) as e:
        raise foreign(path, "has a damaged header") from e
    if not maps:
        raise foreign(path, "holds no maps")
    return Asset(mesh, maps, tangents, name=path.stem)


def _columns(table: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    return np.stack([table[k] for k in names], axis=1).astype(np.float32)
