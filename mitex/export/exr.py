"""Multi-layer OpenEXR: maps and rendered feature views as named channels, float16 or float32."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import OpenEXR

from mitex import __version__
from mitex.asset import Asset
from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.exemplar import MAPS
from mitex.export.common import GENERATOR
from mitex.paths import atomic_write, prepare_output

# Channel names within a layer.
_CHANNELS = {"albedo": "RGB", "normal": "XYZ"}


def write_exr(path: str | os.PathLike[str], channels: Mapping[str, np.ndarray], half: bool = True) -> Path:
    """Writes images as one EXR file.

    Args:
        path: target, .exr.
        channels: channel name, such as "R" or "albedo.R" -> (H, W), all of one size. Stored as they are: EXR
            colours are linear by convention.
        half: float16 instead of float32.

    Returns:
        The path written.

    Raises:
        OutputError: wrong suffix or unwritable place.
        ConfigError: no channels, or of different sizes.
    """
    target = prepare_output(path, (".exr",))
    if len({np.shape(v) for v in channels.values()}) != 1 or np.ndim(next(iter(channels.values()))) != 2:
        raise ConfigError("EXR channels must be images of one size", "give (H, W) arrays")
    dtype = np.float16 if half else np.float32
    limit = np.finfo(dtype).max
    arrays = {k: np.ascontiguousarray(np.clip(v, -limit, limit), dtype) for k, v in channels.items()}
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "software": f"{GENERATOR} {__version__}",
    }
    with atomic_write(target) as temporary:
        try:
            OpenEXR.File(header, arrays).write(str(temporary))
        except RuntimeError as e:  # the library has no other error
            raise OSError(0, str(e)) from e
    return target


def is_exr_of_ours(path: Path) -> bool:
    """Whether a file is an EXR that `write_exr` made, and that no other program has saved since."""
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            return str(file.header().get("software", "")).startswith(f"{GENERATOR} ")
    except Exception:  # RuntimeError and others, by version
        return False


def map_channels(maps: Mapping[str, np.ndarray], prefix: str = "") -> dict[str, np.ndarray]:
    """Maps (H, W, c) as EXR channels: albedo.R/G/B (made linear), normal.X/Y/Z, NAME.Y for the others."""
    channels = {}
    for name, image in maps.items():
        values = srgb_to_linear(image) if name == "albedo" else image
        for k, letter in enumerate(_CHANNELS.get(name, "Y")):
            channels[f"{prefix}{name}.{letter}"] = values[..., k]
    return channels


def write_textures(asset: Asset, path: Path, half: bool = True) -> None:
    """Writes the maps of an asset in texture space (`map_channels`); bakes it first if it is not.

    Raises:
        OutputError: wrong suffix or unwritable place.
    """
    textures = (asset if asset.texture_maps else asset.baked()).texture_maps
    write_exr(path, map_channels(textures or {}), half)


def write_views(
    path: str | os.PathLike[str], images: np.ndarray, names: Sequence[str], half: bool = True
) -> Path:
    """Writes rendered feature views, one layer per view and map: view0.albedo.R, ..., view1.height.Y.

    Args:
        path: target, .exr.
        images: (K, H, W, C) map values; C is the sum of the maps' channels. Albedo sRGB, written linear.
        names: names of `MAPS`, in the order of the channels.

    Raises:
        ConfigError: the names do not add up to C channels.
        OutputError: wrong suffix or unwritable place.
    """
    images = np.asarray(images)
    if set(names) - set(MAPS) or images.ndim != 4 or sum(MAPS[n] for n in names) != images.shape[3]:
        raise ConfigError(
            f"{', '.join(names)} do not name the channels of views of shape {images.shape}",
            f"use names of {', '.join(MAPS)} and (K, H, W, C)",
        )
    ends = np.cumsum([MAPS[n] for n in names])[:-1]
    channels = {}
    for k, view in enumerate(images):
        maps = dict(zip(names, np.split(view, ends, axis=-1), strict=True))
        channels |= map_channels(maps, f"view{k}.")
    return write_exr(path, channels, half)
