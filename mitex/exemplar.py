"""Exemplars: one image, or a folder of PBR maps, or the name of one that ships with Mitex."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from mitex.cache import content_key
from mitex.errors import ImageError
from mitex.geometry.normal_maps import is_normal_map, slope_agreement
from mitex.geometry.vectors import unit
from mitex.images import SUFFIXES, read_image, resize
from mitex.paths import encodable, expanded
from mitex.progress import announce
from mitex.suggestions import suggestion

MAPS = {"albedo": 3, "ambient_occlusion": 1, "height": 1, "normal": 3, "roughness": 1}
MIN_SIDE = 16

DATA = Path(__file__).parent / "data" / "exemplars"

# File names, lower case without separators, as the usual texture sites write them.
ALIASES = {
    "albedo": "albedo basecolor basecolour color colour diffuse diff col",
    "ambient_occlusion": "ambientocclusion ao occlusion occ",
    "height": "height heightmap displacement disp bump depth",
    "normal": "normal normals normalmap normalgl normalopengl norgl nor nrm",
    "normal_dx": "normaldx normaldirectx nordx",
    "roughness": "roughness rough",
}
_BY_ALIAS = {alias: name for name, aliases in ALIASES.items() for alias in aliases.split()}
_OTHER_IMAGES = (".tif", ".tiff", ".webp", ".exr", ".tga", ".bmp", ".gif", ".psd", ".hdr")


@dataclass(frozen=True, eq=False)
class Exemplar:
    """What a texture is learned from.

    Attributes:
        maps: name of `MAPS` -> (H, W, c) float32 in [0, 1], all of one size, row 0 on top. The albedo is
            sRGB; the others are data as stored; normals are tangent-space, (n + 1) / 2, OpenGL (+y up).
        name: for messages and file names.

    Raises:
        ImageError: no map, an unknown name, a wrong shape, sizes that differ.
    """

    maps: dict[str, np.ndarray]
    name: str = "exemplar"

    def __post_init__(self) -> None:
        if not self.maps:
            raise ImageError(f"exemplar {self.name} has no maps", f"give at least one of {', '.join(MAPS)}")
        size = next(iter(self.maps.values())).shape[:2]
        for name, array in self.maps.items():
            if name not in MAPS:
                raise ImageError(f"{name!r} is not a map", f"use {', '.join(MAPS)}")
            if array.shape != (*size, MAPS[name]):
                problem = f"map {name} of {self.name} has shape {array.shape}"
                raise ImageError(problem, f"it must be {(*size, MAPS[name])}")

    @property
    def size(self) -> tuple[int, int]:
        """Height and width [px]."""
        height, width = next(iter(self.maps.values())).shape[:2]
        return height, width

    @cached_property
    def key(self) -> str:
        """A hash of the maps."""
        return content_key(*(part for name in sorted(self.maps) for part in (name, self.maps[name])))

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Exemplar:
        """Load an exemplar.

        Args:
            path: an image file (taken as the albedo), a folder that holds any subset of the maps, or the name
                of an embedded exemplar (see `names`). In a folder, files are recognised by the end of their
                name (`albedo.png`, `Bricks_1K_Color.jpg`, `wall_nor_gl_2k.png`, ...); DirectX normals, by
                name or by their slopes, are turned into OpenGL ones; other files are ignored.

        Returns:
            All maps at the albedo's size (without an albedo: the first map's).

        Raises:
            ImageError: nothing there, no known map, a map twice, aspect ratios that differ, unreadable image,
                normals of exchanged channels.
        """
        source = expanded(path)
        announce(f"reading exemplar {source.name}")
        if not os.path.exists(source) and str(path) in names():
            source = DATA / str(path)
        if os.path.isdir(source):
            return _from_folder(source)
        if not os.path.exists(source):  # unlike Path.exists, also answers for impossible names
            otherwise = f"give an image, a folder of maps or one of {', '.join(names())}"
            raise ImageError(f"there is no exemplar {path}", suggestion(str(path), names(), otherwise))
        return Exemplar({"albedo": _check_side(read_image(source), source)}, encodable(source.stem))

    @staticmethod
    def of(source: Exemplar | str | os.PathLike[str]) -> Exemplar:
        """An exemplar as it is, or that which `load` reads."""
        return source if isinstance(source, Exemplar) else Exemplar.load(source)

    def of_albedo(self) -> Exemplar:
        """The exemplar's albedo alone, for methods that know colours only.

        Raises:
            ImageError: it has none.
        """
        if "albedo" not in self.maps:
            raise ImageError(f"exemplar {self.name} has no albedo", "give an image, or a folder with one")
        return Exemplar({"albedo": self.maps["albedo"]}, self.name)

    def resized(self, size: int) -> Exemplar:
        """The central square of every map, resized to `size` x `size` [px] with antialiasing."""
        if size < 1:
            raise ImageError(f"an exemplar of {size} pixels is not possible", "use a positive size")
        height, width = self.size
        side = min(height, width)
        top, left = (height - side) // 2, (width - side) // 2
        square = {name: m[top : top + side, left : left + side] for name, m in self.maps.items()}
        return Exemplar({name: _resize_map(name, m, size, size) for name, m in square.items()}, self.name)


def names() -> list[str]:
    """Names of the exemplars that ship with Mitex."""
    return sorted(p.name for p in DATA.iterdir() if p.is_dir()) if DATA.is_dir() else []


def map_of(path: Path) -> str | None:
    """Which map a file name stands for: a key of `MAPS`, "normal_dx", or None."""
    words = [
        w for w in re.split(r"[^a-z0-9]+", path.stem.lower()) if w and not re.fullmatch(r"\d+k?|png|jpe?g", w)
    ]
    for count in (2, 1):
        name = _BY_ALIAS.get("".join(words[-count:]))
        if name:
            return name
    return None


def _from_folder(folder: Path) -> Exemplar:
    files = _find_maps(folder)
    if "normal" in files:
        files.pop("normal_dx", None)
    arrays = {}
    for name, file in sorted(files.items()):
        array = _check_side(read_image(file, "L" if MAPS.get(name) == 1 else "RGB"), file)
        if name == "normal_dx":
            array, name = _turned(array), "normal"
        arrays[name] = _upright(array, file) if name == "normal" else array
    return Exemplar(_one_size(arrays, folder), encodable(folder.resolve().name))


def _upright(normals: np.ndarray, file: Path) -> np.ndarray:
    """A normal map whose green points up, as far as its slopes tell."""
    if not is_normal_map(normals):
        raise ImageError(
            f"{file} is not a tangent-space normal map", "export one (mostly blue) or remove the file"
        )
    agreement = slope_agreement(normals)
    if agreement.exchanged:
        raise ImageError(f"red and green of {file} are exchanged", "exchange them, or remove the file")
    if agreement.downward:
        announce(f"green points down in {file.name}, as in DirectX: turned over")
        return _turned(normals)
    return normals


def _turned(normals: np.ndarray) -> np.ndarray:
    red, green, blue = np.moveaxis(normals, 2, 0)
    return np.dstack([red, 1.0 - green, blue])


def _find_maps(folder: Path) -> dict[str, Path]:
    try:
        entries = sorted(p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    except OSError as error:
        raise ImageError(f"{folder} cannot be read ({error.strerror})", "check its permissions") from error
    if not entries:
        raise ImageError(f"{folder} is empty", _remedy())
    files: dict[str, Path] = {}
    for path in entries:
        name = map_of(path)
        if name is None or path.suffix.lower() not in SUFFIXES:
            continue
        if name in files:
            raise ImageError(
                f"{folder} holds {name} twice: {files[name].name} and {path.name}", "remove one of them"
            )
        files[name] = path
    if not files:
        others = [p.name for p in entries if p.suffix.lower() in _OTHER_IMAGES and map_of(p)]
        if others:
            raise ImageError(
                f"{folder} holds {others[0]}, which Mitex does not read", "convert the maps to PNG"
            )
        raise ImageError(f"{folder} holds no map that Mitex knows", _remedy())
    return files


def _one_size(arrays: dict[str, np.ndarray], folder: Path) -> dict[str, np.ndarray]:
    reference = "albedo" if "albedo" in arrays else min(arrays)
    height, width = arrays[reference].shape[:2]
    for name, array in arrays.items():
        h, w = array.shape[:2]
        if abs(w * height - h * width) > 0.01 * h * width:
            problem = (
                f"{name} ({w} x {h}) and {reference} ({width} x {height}) in {folder} differ in aspect ratio"
            )
            raise ImageError(problem, "export all maps from one material")
        arrays[name] = _resize_map(name, array, height, width)
    return dict(sorted(arrays.items()))


def _resize_map(name: str, array: np.ndarray, height: int, width: int) -> np.ndarray:
    if array.shape[:2] == (height, width):
        return array
    result = resize(array, height, width)
    if name == "normal":  # averaged normals are too short
        result = unit(result * 2.0 - 1.0) * 0.5 + 0.5
    return result.astype(np.float32)


def _check_side(array: np.ndarray, path: Path) -> np.ndarray:
    height, width = array.shape[:2]
    if min(height, width) < MIN_SIDE:
        raise ImageError(
            f"{path} is only {width} x {height} pixels", f"an exemplar needs at least {MIN_SIDE} on each side"
        )
    return array


def _remedy() -> str:
    return f"name the files {', '.join(f'{name}.png' for name in MAPS)} (any subset)"
