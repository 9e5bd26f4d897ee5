"""Wavefront OBJ with a material file and PNG maps beside it: the mesh as it was read, polygons and all."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from mitex.asset import DEFAULT_ALBEDO, Asset
from mitex.errors import ImageError, MeshError
from mitex.exemplar import MAPS
from mitex.export.common import (
    GENERATOR,
    asset_from_textures,
    foreign,
    plain_name,
    png,
)
from mitex.export.together import Inputs, check_files, write_files
from mitex.geometry.tangents import split_at_hard_edges
from mitex.images import read_image
from mitex.mesh import Mesh
from mitex.mesh.polygons import outlines
from mitex.mesh.readers import Budget
from mitex.mesh.readers.obj import read_obj as read_obj_soup

# Material keywords, the first one is read back. `norm` and `map_Pr` are the PBR extension of the format;
# Blender reads the normal map from `map_Bump`. Nothing standard fits occlusion: ambient colour comes closest.
_KEYWORDS = {
    "albedo": ("map_Kd",),
    "ambient_occlusion": ("map_Ka",),
    "height": ("disp",),
    "normal": ("norm", "map_Bump"),
    "roughness": ("map_Pr",),
}

HEADER = 4096  # bytes that hold the first two lines


def check_side_files(path: Path, maps: Iterable[str] = MAPS, inputs: Inputs = ()) -> None:
    """Checks that the files beside the mesh `path` may be written: NAME.mtl and NAME_MAP.png for each map.

    Raises:
        OutputError: one of them exists and is not ours, is one of the inputs, or cannot be written.
    """
    stem = plain_name(path.stem)
    names = [f"{stem}.mtl", *(f"{stem}_{k}.png" for k in maps)]
    check_files([path.with_name(name) for name in names], path.name, inputs)


def write_obj(asset: Asset, path: Path) -> None:
    """Writes NAME.obj, NAME.mtl and NAME_MAP.png, all or none; bakes the asset first if it is not.

    Raises:
        OutputError: as `check_side_files`; nothing is written then.
    """
    check_side_files(path, asset.texture_maps or asset.vertex_maps)
    if asset.texture_maps is None:
        asset = asset.baked()
    stem, maps = plain_name(path.stem), asset.texture_maps or {}
    names = {name: f"{stem}_{name}.png" for name in maps}
    files = {path.with_name(names[name]): partial(_write_png, image) for name, image in maps.items()}
    write_files(files | mesh_files(asset, path, names))


def mesh_files(asset: Asset, path: Path, names: Mapping[str, str]) -> dict[Path, Callable[[Path], object]]:
    """The mesh and its material file, for `write_files`.

    Args:
        asset: baked.
        path: of the mesh.
        names: map -> name of its file, beside the mesh.
    """
    stem = plain_name(path.stem)
    return {
        path.with_name(f"{stem}.mtl"): lambda file: file.write_text(_material(asset, stem, names)),
        path: lambda file: _write_mesh(file, asset, stem),
    }


def _write_png(image: np.ndarray, path: Path) -> None:
    path.write_bytes(png(image))


def _material(asset: Asset, stem: str, names: Mapping[str, str]) -> str:
    grey = 1.0 if "albedo" in asset.vertex_maps else DEFAULT_ALBEDO
    lines = [f"# {GENERATOR}", f"newmtl {stem}", f"Kd {grey} {grey} {grey}", "Ks 0 0 0", "Pm 0", "illum 2"]
    for name, file in names.items():
        lines += [f"{keyword} {file}" for keyword in _KEYWORDS[name]]
    return "\n".join(lines) + "\n"


def _write_mesh(path: Path, asset: Asset, stem: str) -> None:
    mesh, atlas = asset.mesh, asset.atlas
    assert atlas is not None
    pairs, uv_index = np.unique(atlas.uv.reshape(-1, 2), axis=0, return_inverse=True)
    vertices, faces = _vertices(mesh)
    split = split_at_hard_edges(mesh)
    corners = np.stack([faces, uv_index.reshape(-1, 3), split.faces], axis=2) + 1
    sizes, (corners,) = outlines(mesh.polygons, [corners])
    words = [f"{v}/{vt}/{vn}" for v, vt, vn in corners.tolist()]
    ends = np.cumsum(sizes)
    with path.open("wb") as file:
        head = f"# {GENERATOR}\nmtllib {stem}.mtl\no {plain_name(asset.name)}\nusemtl {stem}\n"
        file.write(head.encode())
        # Nine digits give every float32 back exactly.
        np.savetxt(file, vertices, "v %.9g %.9g %.9g")
        np.savetxt(file, pairs, "vt %.9g %.9g")
        np.savetxt(file, split.normals, "vn %.9g %.9g %.9g")
        for start, end in zip((ends - sizes).tolist(), ends.tolist(), strict=True):
            file.write(f"f {' '.join(words[start:end])}\n".encode())


def _vertices(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Positions and faces with the vertices that the mesh's own file has, in its order."""
    polygons = mesh.polygons
    if polygons is None or polygons.vertices is None:
        return mesh.vertices, mesh.faces
    corners = polygons.vertices[polygons.triangles]
    _, first, faces = np.unique(corners, return_index=True, return_inverse=True)
    return mesh.vertices[mesh.faces.ravel()[first]], faces.reshape(-1, 3)


def read_obj(path: Path) -> Asset:
    """Reads what `write_obj` wrote.

    Raises:
        MeshError: damaged, not written by Mitex, or a map is missing.
    """
    data = path.read_bytes()
    lines = data[:HEADER].split(b"\n")
    if lines[0] != f"# {GENERATOR}".encode() or not re.match(rb"mtllib \S", b"".join(lines[1:2])):
        raise foreign(path)
    try:
        soup = read_obj_soup(str(path), data, Budget(len(data)))
        if soup.uv is None or soup.normals is None:
            raise foreign(path, "is damaged")
        mesh = Mesh(soup.vertices, soup.faces, soup.uv, path.stem, polygons=soup.polygons)
        mesh = mesh.with_shading_normals(soup.normals)
        material = path.with_name(lines[1].split()[1].decode("utf-8", "replace"))
    except (MeshError, ValueError) as e:
        raise foreign(path, "is damaged") from e
    textures = _textures(path, material)
    if len({v.shape[:2] for v in textures.values()}) != 1:
        raise foreign(path, "has no maps, or maps of different sizes")
    return asset_from_textures(mesh, soup.uv.astype(np.float32), textures, path.stem)


def _textures(path: Path, material: Path) -> dict[str, np.ndarray]:
    try:
        lines = [line.split() for line in material.read_text("utf-8", "replace").split("\n")]
    except OSError as e:
        raise MeshError(f"{path} needs {material.name}", "keep it beside the mesh") from e
    names = {keywords[0]: name for name, keywords in _KEYWORDS.items()}
    textures = {}
    for words in lines:
        if len(words) != 2 or words[0] not in names:
            continue
        file = (material.parent / words[1]).resolve()
        if not file.is_relative_to(material.parent.resolve()):
            raise foreign(path, f"points to {words[1]}, outside of its folder")
        name = names[words[0]]
        try:
            textures[name] = read_image(file, "L" if MAPS[name] == 1 else "RGB")
        except ImageError as e:
            raise MeshError(f"{path}: {e.problem}", "keep the maps beside the mesh") from e
    return textures
