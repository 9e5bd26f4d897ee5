"""A folder with each map in a file of its own, named as exemplars' are: albedo.png, height.png, ..."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from mitex.asset import Asset
from mitex.colour import srgb_to_linear
from mitex.exemplar import MAPS
from mitex.export.common import png
from mitex.export.exr import write_exr
from mitex.export.obj import mesh_files
from mitex.export.together import Inputs, check_files, write_files
from mitex.paths import prepare_output

Format = Literal["png", "exr"]
MESH = "mesh.obj"
DEEP = ("height",)  # maps with more than eight bits


def check_folder(
    folder: Path, kind: Format = "png", inputs: Inputs = (), maps: Iterable[str] = MAPS, mesh: bool = True
) -> Path:
    """Checks that maps may be written to a folder, which need not exist; makes nothing.

    Returns:
        The folder, absolute.

    Raises:
        OutputError: a file of that name is not ours, is one of the inputs, or cannot be written.
    """
    names = [f"{name}.{kind}" for name in maps] + [MESH, "mesh.mtl"] * mesh
    check_files([folder / name for name in names], folder.name, inputs)
    return prepare_output(folder / MESH).parent


def write_maps(maps: Mapping[str, np.ndarray], folder: str | os.PathLike[str], kind: Format = "png") -> Path:
    """Writes maps as files of their own, all or none; `Exemplar.load` reads those of the kind "png".

    - "png": eight bits, heights sixteen.
    - "exr": float16, heights float32; albedo linear, all others as they are.

    Args:
        maps: name of `MAPS` -> (H, W, c) in [0, 1], row 0 on top.
        folder: it is made if it does not exist.
        kind: of the files.

    Returns:
        The folder, absolute.

    Raises:
        OutputError: as `check_folder`; nothing is written then.
    """
    place = check_folder(Path(folder), kind, maps=maps, mesh=False)
    write_files(_map_files(maps, place, kind))
    return place


def write_folder(asset: Asset, folder: Path, kind: Format = "png") -> Path:
    """Writes the maps of an asset, as `write_maps`, and mesh.obj, which `Asset.load` reads with maps of the
    kind "png"; bakes the asset first if it is not.

    Returns:
        The folder, absolute.

    Raises:
        OutputError: as `check_folder`; nothing is written then.
    """
    place = check_folder(folder, kind, maps=asset.vertex_maps)
    asset = asset if asset.texture_maps else asset.baked()
    maps = asset.texture_maps or {}
    names = {name: f"{name}.{kind}" for name in maps}
    write_files(_map_files(maps, place, kind) | mesh_files(asset, place / MESH, names))
    return place


def _map_files(
    maps: Mapping[str, np.ndarray], folder: Path, kind: Format
) -> dict[Path, Callable[[Path], object]]:
    write = _write_png if kind == "png" else _write_exr
    return {folder / f"{name}.{kind}": partial(write, name, image) for name, image in maps.items()}


def _write_png(name: str, image: np.ndarray, path: Path) -> None:
    path.write_bytes(png(image, 16 if name in DEEP else 8))


def _write_exr(name: str, image: np.ndarray, path: Path) -> None:
    values = srgb_to_linear(image) if name == "albedo" else image
    letters = "RGB" if MAPS[name] == 3 else "Y"
    channels = {letter: values[..., k] for k, letter in enumerate(letters)}
    write_exr(path, channels, half=name not in DEEP)
