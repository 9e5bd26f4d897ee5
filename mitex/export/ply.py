"""PLY: binary, 8-bit vertex colours that every tool shows, the other maps as float properties.

The format has one normal per vertex. So vertices are split at hard edges, and `vertex` says which they were.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mitex.asset import Asset
from mitex.export.common import GENERATOR, foreign
from mitex.geometry.tangents import split_at_hard_edges
from mitex.images import to_bytes
from mitex.mesh import Mesh
from mitex.mesh.polygons import outlines
from mitex.mesh.readers import Budget
from mitex.mesh.readers.ply import read_tables, soup_of_tables
from mitex.paths import atomic_write

# Property names of the float maps; albedo is red, green, blue.
_FLOATS = {
    "ambient_occlusion": ("ambient_occlusion",),
    "height": ("height",),
    "normal": ("normal_map_x", "normal_map_y", "normal_map_z"),
    "roughness": ("roughness",),
}
_POINT = ("x", "y", "z", "nx", "ny", "nz")
_TANGENT = ("tangent_x", "tangent_y", "tangent_z")
_COLOURS = ("red", "green", "blue")
_NAMES = {"<f4": "float", "<u4": "uint", "<u2": "ushort", "|u1": "uchar"}


def write_ply(asset: Asset, path: Path) -> None:
    """Writes the mesh with its vertex maps: albedo as uchar sRGB, all others as float in [0, 1]."""
    vertices = _vertices(asset)
    split = split_at_hard_edges(asset.mesh)
    corners = [split.faces[..., None]] + ([] if asset.mesh.uv is None else [asset.mesh.uv])
    sizes, (index, *uv) = outlines(asset.mesh.polygons, corners)
    count = "uchar" if 2 * sizes.max(initial=0) < 256 else "ushort"
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {GENERATOR}; maps in [0, 1], colours sRGB",
        f"element vertex {len(vertices)}",
        *(f"property {_NAMES[vertices.dtype[k].str]} {k}" for k in vertices.dtype.names or ()),
        f"element face {len(sizes)}",
        f"property list {count} int vertex_indices",
        *(f"property list {count} float texcoord" for _ in uv),
        "end_header\n",
    ]
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        file.write("\n".join(header).encode())
        file.write(vertices.tobytes())
        file.write(_rows(sizes, index[:, 0], uv[0] if uv else None, "<u2" if count == "ushort" else "u1"))


def _vertices(asset: Asset) -> np.ndarray:
    """The table of the split vertices."""
    mesh, split = asset.mesh, split_at_hard_edges(asset.mesh)
    positions = mesh.vertices[split.source]
    columns: dict[str, np.ndarray] = dict(zip(_POINT, (*positions.T, *split.normals.T), strict=True))
    if asset.tangents is not None:
        columns |= dict(zip(_TANGENT, asset.tangents[split.source].T, strict=True))
    for name, properties in _FLOATS.items():
        if name in asset.vertex_maps:
            columns |= dict(zip(properties, asset.vertex_maps[name][split.source].T, strict=True))
    if mesh.corner_normals is not None:
        columns["vertex"] = split.source.astype(np.uint32)
    if "albedo" in asset.vertex_maps:
        rgb = to_bytes(asset.vertex_maps["albedo"][split.source])
        columns |= dict(zip(_COLOURS, rgb.T, strict=True))
    table = np.empty(len(split.source), [(k, v.dtype.newbyteorder("<")) for k, v in columns.items()])
    for key, values in columns.items():
        table[key] = values
    return table


def _rows(sizes: np.ndarray, index: np.ndarray, uv: np.ndarray | None, count: str) -> bytes:
    """Polygons of (P,) sizes, one after the other: their vertices, from (N,), and UVs, from (N, 2)."""
    kinds = {}
    for size in np.unique(sizes).tolist():
        texcoord = [] if uv is None else [("numbers", count), ("texcoord", "<f4", (size, 2))]
        kinds[size] = np.dtype([("size", count), ("vertices", "<i4", (size,)), *texcoord])
    lengths = np.zeros(max(kinds, default=0) + 1, np.int64)
    lengths[list(kinds)] = [kind.itemsize for kind in kinds.values()]
    ends, starts = np.cumsum(lengths[sizes]), np.cumsum(sizes) - sizes
    data = np.empty(ends[-1] if len(ends) else 0, np.uint8)
    for size, kind in kinds.items():
        which = np.flatnonzero(sizes == size)
        corners = starts[which, None] + np.arange(size)
        rows: Any = np.empty(len(which), kind)
        rows["size"], rows["vertices"] = size, index[corners]
        if uv is not None:
            rows["numbers"], rows["texcoord"] = 2 * size, uv[corners]
        places = (ends[which] - kind.itemsize)[:, None] + np.arange(kind.itemsize)
        data[places] = rows.view(np.uint8).reshape(len(which), -1)
    return data.tobytes()


def read_ply(path: Path) -> Asset:
    """Reads what `write_ply` wrote.

    Raises:
        MeshError: damaged, or not written by Mitex.
    """
    data = path.read_bytes()
    lines = data[:4096].split(b"\n")
    own = lines[:2] == [b"ply", b"format binary_little_endian 1.0"] and GENERATOR.encode() in lines[2:3][0]
    if not own:
        raise foreign(path)
    tables, left = read_tables(str(path), data, Budget(len(data)))
    if left:
        raise foreign(path, "holds more than its header says")
    table, soup = tables["vertex"], soup_of_tables(str(path), tables)
    first, faces = np.arange(len(soup.vertices)), soup.faces
    if "vertex" in table:
        _, first, vertex = np.unique(table["vertex"], return_index=True, return_inverse=True)
        faces = vertex[faces]
    maps = {k: _columns(table, p)[first] for k, p in _FLOATS.items() if p[0] in table}
    if "red" in table:
        maps["albedo"] = _columns(table, _COLOURS)[first] / np.float32(255.0)
    tangents = _columns(table, _TANGENT)[first] if _TANGENT[0] in table else None
    if not maps or soup.normals is None:
        raise foreign(path, "holds no maps or no normals")
    mesh = Mesh(soup.vertices[first], faces, soup.uv, path.stem, polygons=soup.polygons)
    return Asset(mesh.with_shading_normals(soup.normals), maps, tangents, name=path.stem)


def _columns(table: dict[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray:
    return np.stack([table[k] for k in names], axis=1).astype(np.float32)
