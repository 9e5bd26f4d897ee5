"""Pictures of shapes without colours."""

from __future__ import annotations

import numpy as np

from mitex.asset import Asset
from mitex.mesh import Mesh
from mitex.render import still, tone

CLAY = 0.7


def clay(mesh: Mesh) -> Asset:
    """The mesh in light grey."""
    return Asset(mesh, {"albedo": np.full((len(mesh.vertices), 3), CLAY, np.float32)}, name=mesh.name)


def portrait(vertices: np.ndarray, faces: np.ndarray, resolution: int = 256, spp: int = 16) -> np.ndarray:
    """A small picture (H, W, 3) of a shape, sRGB in [0, 1]."""
    return tone(still(clay(Mesh(vertices, faces)), resolution=resolution, spp=spp))
