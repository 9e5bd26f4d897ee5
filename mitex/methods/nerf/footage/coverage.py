"""What a capture lacks, in words: sides that were not filmed, and an object too small or cut off."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mitex.geometry.vectors import unit
from mitex.methods.nerf.capture.visual_hull import View

RINGS = {"level with it": 12.0, "from half above": 38.0, "from above": 65.0}  # elevations [degrees]
SECTORS = (
    "the front", "the front right", "the right side", "the back right",
    "the back", "the back left", "the left side", "the front left",
)  # fmt: skip
# From the nearest camera, at which a side counts as not filmed [degrees]: less than from ring to ring.
FAR = 24.0
SMALL = 0.4  # part of the picture's shorter side that the object should fill
CUT = 0.3  # part of the pictures in which the frame may cut the object


def advice(views: Sequence[View], middle: np.ndarray) -> list[str]:
    """What to film again, one sentence each; empty if nothing.

    Args:
        views: with masks; z is up, and the first one is in front of the object.
        middle: (3,) of the object.
    """
    return [*_sides(np.stack([view.pose[:, 3] for view in views]) - middle), *_framing(views)]


def _sides(towards: np.ndarray) -> list[str]:
    """Sides to film: rings in which a sector has no camera (N, 3) near its direction."""
    directions = unit(towards)
    start = math.atan2(directions[0, 1], directions[0, 0])
    lines = []
    for ring, elevation in RINGS.items():
        gaps = [
            _gap(directions, start + 2.0 * math.pi * k / len(SECTORS), elevation) for k in range(len(SECTORS))
        ]
        missing = {name: gap for name, gap in zip(SECTORS, gaps, strict=True) if gap > FAR}
        if missing:
            sides = "it all around" if len(missing) == len(SECTORS) else _listed([*missing])
            lines.append(f"film {sides} {ring}: no picture within {min(missing.values()):.0f} degrees")
    return lines


def _gap(directions: np.ndarray, azimuth: float, elevation: float) -> float:
    """Angle [degrees] between a direction around z and the nearest of unit vectors (N, 3)."""
    height = math.radians(elevation)
    aim = (math.cos(azimuth) * math.cos(height), math.sin(azimuth) * math.cos(height), math.sin(height))
    return math.degrees(math.acos(min(max(float((directions @ np.array(aim)).max()), -1.0), 1.0)))


def _framing(views: Sequence[View]) -> list[str]:
    sizes = [max(np.ptp(index) + 1 for index in np.nonzero(v.mask)) / min(v.mask.shape) for v in views]
    cut = sum(not view.whole for view in views)
    lines = []
    if (size := float(np.median(sizes))) < SMALL:
        lines.append(f"go nearer: the object fills {100 * size:.0f} % of the picture")
    if cut > CUT * len(views):
        lines.append(f"step back: the frame cuts the object off in {cut} of {len(views)} pictures")
    return lines


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
