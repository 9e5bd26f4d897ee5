"""Surfaces of values on a regular grid."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from mitex.mesh import Mesh
from mitex.optional import optional


def isosurface(values: np.ndarray, level: float, *, low: np.ndarray, cell: float, name: str = "mesh") -> Mesh:
    """The surface around what is above a level: marching cubes (Lorensen and Cline 1987).

    Args:
        values: (X, Y, Z) float32; beyond the grid they are taken to be below the level, so that the surface
            closes there.
        level: somewhere exceeded.
        low: (3,) place of `values[0, 0, 0]`.
        cell: distance of neighbouring values.
        name: of the mesh.

    Raises:
        MissingPackage: scikit-image is not installed.
    """
    marching_cubes = optional("skimage.measure", "nerf").marching_cubes
    below = min(float(values.min()), level - 1.0)
    padded = np.pad(values, 1, constant_values=below)
    # "ascent" winds the faces around large values counter-clockwise as seen from outside.
    vertices, faces, _, _ = marching_cubes(padded, level, gradient_direction="ascent", allow_degenerate=False)
    return Mesh(low + cell * (vertices - 1.0), faces, name=name)


def without_cavities(values: np.ndarray, level: float) -> np.ndarray:
    """The values (X, Y, Z), raised to their maximum in the hollows that what is above the level encloses."""
    solid = values > level
    hollow = np.asarray(ndimage.binary_fill_holes(solid)) & ~solid
    return np.where(hollow, values.max(), values)
