"""Writing assets as GLB, OBJ, PLY, EXR, HTML or folders of maps, and reading the first three back."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from mitex.asset import Asset
from mitex.errors import ConfigError, MeshError
from mitex.export.common import REMEDY
from mitex.export.exr import write_exr, write_textures, write_views
from mitex.export.folder import Format, check_folder, write_folder, write_maps
from mitex.export.glb import read_glb, write_glb, write_variants
from mitex.export.obj import check_side_files, read_obj, write_obj
from mitex.export.ply import read_ply, write_ply
from mitex.export.relief import embossed
from mitex.export.together import Inputs
from mitex.page import write_still
from mitex.paths import expanded, prepare_output
from mitex.progress import announce
from mitex.reading import reading
from mitex.suffixes import ASSETS as SUFFIXES

__all__ = [
    "Format",
    "SUFFIXES",
    "check_folder",
    "embossed",
    "is_folder",
    "prepare_export",
    "read_asset",
    "read_glb",
    "read_obj",
    "read_ply",
    "write_asset",
    "write_exr",
    "write_glb",
    "write_maps",
    "write_obj",
    "write_ply",
    "write_textures",
    "write_variants",
    "write_views",
]

SLASHES = tuple(filter(None, (os.sep, os.altsep)))
_WRITERS = {
    ".glb": write_glb,
    ".obj": write_obj,
    ".ply": write_ply,
    ".exr": write_textures,
    ".html": write_still,
}
_READERS = {".glb": read_glb, ".obj": read_obj, ".ply": read_ply}


def is_folder(path: str | os.PathLike[str]) -> bool:
    """Whether an asset's path stands for a folder of maps: it ends with a slash, or is there already."""
    place = expanded(path)
    return os.fspath(path).endswith(SLASHES) or (place.suffix.lower() not in SUFFIXES and place.is_dir())


def prepare_export(
    path: str | os.PathLike[str],
    suffixes: Sequence[str] = SUFFIXES,
    inputs: Inputs = (),
    maps_format: Format = "png",
) -> Path:
    """`prepare_output` for an asset: checks the files beside an OBJ or in a folder too, before any long work.

    Raises:
        OutputError: as `prepare_output`, or one of those files is an input or was not written by Mitex.
    """
    inputs = list(inputs)
    if is_folder(path):
        return check_folder(expanded(path), maps_format, inputs)
    target = prepare_output(path, suffixes, inputs)
    if target.suffix.lower() == ".obj":
        check_side_files(target, inputs=inputs)
    return target


def write_asset(asset: Asset, path: str | os.PathLike[str], maps_format: Format = "png") -> Path:
    """See `Asset.export`."""
    announce(f"writing {os.path.basename(os.path.normpath(path))}")
    if is_folder(path):
        return write_folder(asset, expanded(path), maps_format)
    target = prepare_output(path, SUFFIXES)
    _WRITERS[target.suffix.lower()](asset, target)
    return target


def read_asset(path: str | os.PathLike[str]) -> Asset:
    """See `Asset.load`."""
    source = expanded(path)
    reader = _READERS.get(source.suffix.lower())
    if reader is None:
        raise MeshError(f"{path} is not an asset file", f"give one of {', '.join(_READERS)}")
    if not os.path.isfile(source):
        raise MeshError(f"there is no asset file {path}", "check the path")
    announce(f"reading {source.name}")
    with reading(source, MeshError, REMEDY, "is damaged or was not written by Mitex", also=(ConfigError,)):
        return reader(source)
