"""Methods to mask the object, as words of `--mask`."""

from __future__ import annotations

import re
from dataclasses import dataclass

from mitex.errors import ConfigError

METHODS = "plane, hull, box:X,Y,W,H or colour:#RRGGBB"


@dataclass(frozen=True)
class MaskMethod:
    """How the object is told from its surroundings.

    Attributes:
        kind: "plane", what stands on a table; "hull", what all pictures have in their middle; "box", what is
            in a box of the first picture; "colour", what has not the background's colour.
        box: left, top, width, height in the first picture, as parts of its width and height.
        colour: sRGB in [0, 255].
    """

    kind: str
    box: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    colour: tuple[int, int, int] = (0, 0, 0)


def mask_method(words: str) -> MaskMethod:
    """The method that words of `--mask` name.

    Raises:
        ConfigError: they name none, or the box is not inside of the picture.
    """
    kind, _, value = words.partition(":")
    if words in ("plane", "hull"):
        return MaskMethod(words)
    if kind == "colour" and re.fullmatch(r"#?[0-9a-fA-F]{6}", value):
        red, green, blue = bytes.fromhex(value.removeprefix("#"))
        return MaskMethod("colour", colour=(red, green, blue))
    if kind == "box" and re.fullmatch(r"[0-9.]+(,[0-9.]+){3}", value):
        return MaskMethod("box", box=_box(value))
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
