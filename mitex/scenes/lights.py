"""Lights as Mitsuba dictionaries: a studio environment made here, and area lights."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mitex.geometry.vectors import unit

# Softboxes of the studio: where they are, half width and height at distance 1, linear radiance.
_BOXES = (
    ((-0.8, 0.9, 0.9), (0.45, 0.45), (6.4, 6.1, 5.7)),  # key, upper left behind a camera on +z
    ((1.2, 0.3, 0.7), (0.45, 0.80), (0.9, 1.0, 1.15)),  # fill, right
    ((0.9, 1.6, -0.9), (0.30, 0.60), (4.0, 4.0, 4.0)),  # rim, above and behind the object
)


def studio_image(height: int = 128) -> np.ndarray:
    """A photographer's studio: a grey gradient from floor to ceiling, a key, a fill and a rim softbox.

    Args:
        height: rows; there are twice as many columns.

    Returns:
        (height, 2 height, 3) float32 linear radiance in the layout of Mitsuba's `envmap`: row 0 is +y, the
        columns run from -z over +x, +z and -x back to -z.
    """
    v, u = np.mgrid[:height, : 2 * height] + 0.5
    polar, turn = math.pi * v / height, math.pi * u / height
    direction = np.stack(
        (np.sin(polar) * np.sin(turn), np.cos(polar), -np.sin(polar) * np.cos(turn)), axis=-1
    )
    above = _smoothstep(-0.5, 0.9, direction[..., 1:2])
    image = (1 - above) * np.array((0.08, 0.076, 0.072)) + above * np.array((0.40, 0.42, 0.45))
    for position, (half_width, half_height), radiance in _BOXES:
        forward = unit(np.array(position))
        right = unit(np.cross(forward, (0.0, 1.0, 0.0)))
        # Coordinates on the plane of the box, which is at distance 1; behind the centre it is out of sight.
        depth = np.maximum(direction @ forward, 1e-3)
        x, y = direction @ right / depth, direction @ np.cross(right, forward) / depth
        inside = _fades(np.abs(x), half_width) * _fades(np.abs(y), half_height)
        image = image + inside[..., None] * np.array(radiance)
    return image.astype(np.float32)


def environment() -> dict[str, Any]:
    """A Mitsuba `envmap` of `studio_image`, which needs no file; it belongs to a camera on +z."""
    from mitex.runtime.jit import mi

    return {"type": "envmap", "bitmap": mi.Bitmap(studio_image())}


def key_light(strength: float = 1.0, radius: float = 1.0) -> dict[str, Any]:
    """A warm square area light, upper left of an object of the given radius at the origin, seen from +z.

    Args:
        strength: factor on the radiance.
        radius: of the object [mesh units]; sizes and distances scale with it, the picture's brightness does
            not.

    Returns:
        A scene entry.
    """
    from mitex.runtime.jit import mi

    place = [radius * p for p in (-2.6, 3.0, 3.2)]
    to_world = mi.ScalarTransform4f().look_at(origin=place, target=[0, 0, 0], up=[0, 1, 0])
    radiance = [strength * r for r in (20.0, 19.0, 17.5)]
    return {
        "type": "rectangle",
        "to_world": to_world @ mi.ScalarTransform4f().scale(1.1 * radius),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
    }


def _fades(distance: np.ndarray, half: float) -> np.ndarray:
    """1 inside `half`, 0 well outside, with a soft edge."""
    return 1 - _smoothstep(0.9 * half, 1.15 * half, distance)


def _smoothstep(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = ((x - low) / (high - low)).clip(0, 1)
    return t * t * (3 - 2 * t)
