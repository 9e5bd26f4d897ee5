"""Wavefront OBJ with a material file and PNG maps beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from mitex.asset import Asset
from mitex.errors import ImageError, MeshError
from mitex.exemplar import MAPS
from mitex.export.common import (
    DEFAULT_ALBEDO,
    GENERATOR,
    asset_from_textures,
    foreign,
    plain_name,
    png,
)
from mitex.export.together import Inputs, check_files, write_files
from mitex.images import read_image
from mitex.mesh import Mesh

# Material keywords, the first one is read back. `norm` and `map_Pr` are the PBR extension of the format;
# Blender reads the normal map from `map_Bump`. Nothing standard fits occlusion: ambient colour comes closest.
_KEYWORDS = {
    "albedo": ("map_Kd",),
    "ambient_occlusion": ("map_Ka",),
    "height": ("disp",),
    "normal": ("norm", "map_Bump"),
    "roughness": ("map_Pr",),
}


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
    corners = np.stack([mesh.faces, uv_index.reshape(-1, 3), mesh.faces], axis=2) + 1
    with path.open("wb") as file:
        head = f"# {GENERATOR}\nmtllib {stem}.mtl\no {plain_name(asset.name)}\nusemtl {stem}\n"
        file.write(head.encode())
        # Nine digits give every float32 back exactly.
        np.savetxt(file, mesh.vertices, "v %.9g %.9g %.9g")
        np.savetxt(file, pairs, "vt %.9g %.9g")
        np.savetxt(file, mesh.normals, "vn %.6g %.6g %.6g")
        np.savetxt(file, corners.reshape(-1, 9), "f %d/%d/%d %d/%d/%d %d/%d/%d")


def read_obj(path: Path) -> Asset:
    """Reads what `write_obj` wrote.

    Raises:
        MeshError: damaged, not written by Mitex, or a map is missing.
    """
    lines = path.read_text("utf-8", "replace").split("\n")
    if lines[0] != f"# {GENERATOR}" or not "".join(lines[1:2]).startswith("mtllib "):
        raise foreign(path)
    try:
        vertices = _rows(lines, "v ", 3, np.float32)
        pairs = _rows(lines, "vt ", 2, np.float32)
        faces = _rows((line.replace("/", " ") for line in lines), "f ", 9, np.int64).reshape(-1, 3, 3) - 1
        # A negative index would silently count from the end.
        uv = pairs[np.where(faces[..., 1] < 0, len(pairs), faces[..., 1])]
        mesh = Mesh(vertices, faces[..., 0], uv, path.stem)
        textures = _textures(path, path.with_name(lines[1].split()[1]))
    except (ValueError, IndexError) as e:
        raise foreign(path, "is damaged") from e
    if len({v.shape[:2] for v in textures.values()}) != 1:
        raise foreign(path, "has no maps, or maps of different sizes")
    return asset_from_textures(mesh, uv, textures, path.stem)


def _rows(lines: Iterable[str], start: str, width: int, dtype: type) -> np.ndarray:
    rows = [line[len(start) :] for line in lines if line.startswith(start)]
    return np.array(" ".join(rows).split(), dtype).reshape(len(rows), width)


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
