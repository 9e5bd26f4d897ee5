"""The fields that have names: those of table 8 of the MeshNCA paper."""

from __future__ import annotations

import numpy as np

from mitex.geometry.vectors import unit
from mitex.mesh.mesh import Mesh

CONSTANT = {"right": (1, 0, 0), "left": (-1, 0, 0), "up": (0, 1, 0), "down": (0, -1, 0)}
SHEARS = {"shear-up": 1, "shear-down": -1}
AXES = {"about-x": (1, 0, 0), "about-y": (0, 1, 0)}
NAMES = (*CONSTANT, *SHEARS, *AXES)


def named_vectors(mesh: Mesh, name: str) -> np.ndarray:
    """(V, 3) float64 vectors of the field called `name`, one of `NAMES`; see `mitex.mesh.fields`.

    Raises:
        MeshError: all vertices are at one point.
    """
    points = mesh.normalised()[0].vertices.astype(np.float64)
    if name in CONSTANT:
        return np.tile(np.array(CONSTANT[name], np.float64), (len(points), 1))
    if name in SHEARS:
        return np.outer(SHEARS[name] * (points[:, 2] + 1.0), [0.0, 1.0, 0.0])
    return np.cross(AXES[name], unit(points))
