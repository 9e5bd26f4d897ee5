"""What options mean that several commands of MeshNCA share."""

from __future__ import annotations

from mitex.errors import ConfigError
from mitex.methods.checks import in_range
from mitex.ranges import TURNS

RESOLUTION = 1024  # of baked textures [texels]


def oriented(orientation: str) -> float | str:
    """What --orientation means: an angle [degrees], or a vector field.

    Raises:
        ConfigError: an angle out of range.
    """
    try:
        angle = float(orientation)
    except ValueError:
        return orientation
    in_range("--orientation", angle, *TURNS)
    return angle


def levels(subdivide: str) -> int | str:
    """What --subdivide means.

    Raises:
        ConfigError: neither auto nor a number of levels.
    """
    if subdivide == "auto":
        return "auto"
    if subdivide not in list("0123456"):
        raise ConfigError(f"--subdivide cannot be {subdivide!r}", "use auto or a number from 0 to 6")
    return int(subdivide)
