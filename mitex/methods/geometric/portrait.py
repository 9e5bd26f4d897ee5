"""A shape without colours, rendered for previews."""

from __future__ import annotations

import numpy as np

from mitex.asset import clay
from mitex.mesh import Mesh
from mitex.render import still, tone


def portrait(vertices: np.ndarray, faces: np.ndarray, resolution: int = 256, spp: int = 16) -> np.ndarray:
    """A small image (H, W, 3) of a shape, sRGB in [0, 1]."""
    return tone(still(clay(Mesh(vertices, faces)), resolution=resolution, spp=spp))
