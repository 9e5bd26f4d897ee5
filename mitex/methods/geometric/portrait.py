"""A shape without colours, rendered for previews."""

from __future__ import annotations

import numpy as np

from mitex.asset import clay
from mitex.mesh import Mesh
from mitex.render import still, tone


def portrait(vertices: np.ndarray, faces: np.ndarray, resolution: int = 256, spp: int = 16) -> np.ndarray:
    """A small picture of a shape in grey.

    Args:
        vertices: (V, 3).
        faces: (F, 3).
        resolution: side of the picture [px].
        spp: samples per pixel.

    Returns:
        (H, W, 3) float32, sRGB in [0, 1].
    """
    return tone(still(clay(Mesh(vertices, faces)), resolution=resolution, spp=spp))
