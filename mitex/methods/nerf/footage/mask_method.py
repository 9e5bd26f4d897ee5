"""Methods to mask the object, as words of `--mask`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from mitex.errors import ConfigError
from mitex.methods.checks import in_range

METHODS = "plane, hull, box:X,Y,W,H, colour:#RRGGBB or network:FILE.onnx"
NUMBER = r"\d+\.?\d*"
NETWORK = rf"(.+\.onnx)(?:,(\d{{1,6}}))?(?:,({NUMBER}),({NUMBER}))?"
SIDES = (16, 4096)  # of the pictures that a network takes [pixels]


@dataclass(frozen=True)
class NetworkFile:
    """A network that masks, and what its file may leave open.

    Attributes:
        path: of the ONNX file.
        side: of the square pictures that it takes [pixels]; None for what the file says, or 320.
        colours: what is subtracted from sRGB in [0, 1], and what that is divided by; None for ImageNet's mean
            and standard deviation.
    """

    path: str
    side: int | None = None
    colours: tuple[float, float] | None = None


@dataclass(frozen=True)
class MaskMethod:
    """How the object is told from its surroundings.

    Attributes:
        kind: "plane", what stands on a table; "hull", what all pictures have in their middle; "box", what is
            in a box of the first picture; "colour", what has not the background's colour; "network", what a
            network takes for the object.
        box: left, top, width, height in the first picture, as parts of its width and height.
        colour: sRGB in [0, 255].
        network: its file.
    """

    kind: str
    box: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    colour: tuple[int, int, int] = (0, 0, 0)
    network: NetworkFile | None = None


def mask_method(words: str) -> MaskMethod:
    """The method that words of `--mask` name.

    Raises:
        ConfigError: they name none, the box is not inside of the picture, or a number is out of range.
    """
    kind, _, value = words.partition(":")
    if words in ("plane", "hull"):
        return MaskMethod(words)
    if kind == "colour" and re.fullmatch(r"#?[0-9a-fA-F]{6}", value):
        red, green, blue = bytes.fromhex(value.removeprefix("#"))
        return MaskMethod("colour", colour=(red, green, blue))
    if kind == "box" and re.fullmatch(r"[0-9.]+(,[0-9.]+){3}", value):
        return MaskMethod("box", box=_box(value))
    if kind == "network" and (match := re.fullmatch(NETWORK, value, re.IGNORECASE)):
        return MaskMethod("network", network=_network(*match.groups()))
    raise ConfigError(f"'{words}' is no way to mask", f"use {METHODS}")


def _box(value: str) -> tuple[float, float, float, float]:
    try:
        left, top, width, height = (float(number) / 100.0 for number in value.split(","))
    except ValueError as error:
        raise ConfigError(f"'{value}' is no box", "give four numbers, X,Y,W,H") from error
    if not (width > 0.0 and height > 0.0 and left + width <= 1.0 and top + height <= 1.0):
        raise ConfigError(
            f"the box {value} is not inside the picture", "give per cent of its width and height"
        )
    return left, top, width, height


def _network(path: str, size: str | None, mean: str | None, spread: str | None) -> NetworkFile:
    side = int(size) if size else None
    in_range("the network's size", side, *SIDES)
    if mean is None or spread is None:
        return NetworkFile(path, side)
    colours = float(mean), float(spread)
    in_range("the network's mean", colours[0], 0.0, 1.0)
    in_range("the network's standard deviation", colours[1], 0.001, 10.0)
    return NetworkFile(path, side, colours)
