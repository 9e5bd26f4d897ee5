"""Regions of a mesh, in words."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np

from mitex.errors import ConfigError

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
AXES = {"x": 0, "y": 1, "z": 2}

Region = Callable[[np.ndarray], np.ndarray]
"""From points (P, 3) [mesh units] to whether they are inside, (P,) bool."""


def region(text: str) -> Region:
    """A region of space.

    Args:
        text: "X,Y,Z,RADIUS" for a ball; "x:LOW:HIGH" for what lies between two heights along an axis, and
            without one of them for a half: "y:0:" is all above 0.

    Raises:
        ConfigError: the text is neither.
    """
    if ball := re.fullmatch(rf"({NUMBER}),({NUMBER}),({NUMBER}),({NUMBER})", text):
        *centre, radius = map(float, ball.groups())
        if radius > 0:
            return lambda points: np.linalg.norm(points - np.array(centre), axis=1) <= radius
    if slab := re.fullmatch(rf"([xyz]):({NUMBER})?:({NUMBER})?", text):
        axis, low, high = AXES[slab[1]], float(slab[2] or -math.inf), float(slab[3] or math.inf)
        return lambda points: (points[:, axis] >= low) & (points[:, axis] <= high)
    raise ConfigError(f"'{text}' is no region", "give X,Y,Z,RADIUS for a ball, or y:0: for the half above 0")
