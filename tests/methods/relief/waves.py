"""An exemplar whose relief is known."""

import numpy as np

from mitex.exemplar import Exemplar
from mitex.geometry.normal_maps import of_slopes

SIDE = 64
AMPLITUDE = 0.03  # [widths]


def elevation(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Heights [widths] at places u to the right and v upwards [widths]."""
    return AMPLITUDE * (np.sin(4 * np.pi * u) + 0.5 * np.cos(2 * np.pi * v))


def rises(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Their derivatives to the right and upwards."""
    right = 4 * np.pi * np.cos(4 * np.pi * u)
    up = -np.pi * np.sin(2 * np.pi * v)
    return AMPLITUDE * np.stack([right, up], axis=-1)


def waves(*maps: str, side: int = SIDE) -> Exemplar:
    """The exemplar with some of `height` (from 0 to 1), `normal` and `albedo` (red where it is high)."""
    centres = (np.arange(side) + 0.5) / side
    u, v = np.meshgrid(centres, 1 - centres)
    heights = elevation(u, v)
    grey = ((heights - heights.min()) / np.ptp(heights)).astype(np.float32)[..., None]
    every = {
        "height": grey,
        "normal": of_slopes(rises(u, v)),
        "albedo": np.concatenate([grey, 0.2 + 0 * grey, 1 - grey], axis=2),
    }
    return Exemplar({name: every[name] for name in maps}, "waves")
