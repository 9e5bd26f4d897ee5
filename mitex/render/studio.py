"""The set: lights, and a backdrop that rises behind the object without a horizon."""

from __future__ import annotations

import math

import numpy as np

from mitex.mesh import Mesh
from mitex.scenes.lights import key_light

KEY = 0.77  # strength of the key light
KEY_DISTANCE = 1.6  # [object radii]; a key light far away lights the floor evenly
GROUND, SKY = (0.22, 0.21, 0.20), (1.05, 1.11, 1.18)  # radiance of the dome below and above
GREY = 0.72  # backdrop reflectance


def lights() -> dict[str, object]:
    """Scene entries for an object of radius 1 at the origin and a camera on the +z side.

    A soft key light from the upper left, and a dome that brightens upwards. The dome is smooth on purpose:
    with the softboxes of `scenes.lights.environment` in it, the same picture takes twice the samples.
    """
    from mitex.runtime.jit import mi

    key = key_light(KEY, radius=KEY_DISTANCE)
    # Mitsuba's envmap wants more than one column; the dome does not depend on it.
    up = np.sin(np.linspace(0.5, -0.5, 64) * math.pi)[:, None, None].repeat(128, axis=1)
    share = np.clip((up + 0.4) / 1.4, 0.0, 1.0)
    image = (1.0 - share) * np.array(GROUND) + share * np.array(SKY)
    return {"dome": {"type": "envmap", "bitmap": mi.Bitmap(image.astype(np.float32))}, "key": key}


def backdrop(floor: float) -> Mesh:
    """A sheet of paper: a floor at height `floor`, a quarter circle and a wall behind the object.

    Args:
        floor: height of the floor [object radii].
    """
    near, bend, radius, width, steps = 14.0, -2.2, 2.2, 16.0, 24
    angle = np.linspace(0.0, 0.5 * math.pi, steps)
    z = np.concatenate([[near], bend - radius * np.sin(angle), [bend - radius]])
    y = np.concatenate([[0.0], radius - radius * np.cos(angle), [near]]) + floor
    sides = [np.stack([np.full_like(y, x), y, z], axis=1) for x in (-width, width)]
    i, count = np.arange(len(y) - 1), len(y)
    faces = np.concatenate(
        [np.stack([i, count + i, i + 1], axis=1), np.stack([i + 1, count + i, count + i + 1], axis=1)]
    )
    return Mesh(np.concatenate(sides), faces, name="backdrop")
