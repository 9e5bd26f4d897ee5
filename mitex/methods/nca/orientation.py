"""Which way a texture is turned on the surface: by one angle, or so that it follows a vector field."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from mitex.geometry.vectors import dot, orthonormal, rotate_about, unit
from mitex.mesh import Mesh
from mitex.methods.nca.motion.condition import cell_vectors

Orientation = float | str | Path | np.ndarray
"""An angle [degrees], or a vector field, as `mitex.mesh.fields.vector_field` takes it."""

Turn = float | np.ndarray
"""An angle about the normals [rad]: one, or (V,) of the vertices of an automaton's mesh."""


def cell_turns(orientation: Orientation, cells: Mesh, base: Mesh) -> Turn:
    """The angle by which the texture is turned, counter-clockwise, from where its up is +y.

    Args:
        orientation: an angle, or a field that the exemplar's up follows.
        cells: V vertices.
        base: the mesh whose vertices the vectors of a file or an array belong to.

    Raises:
        ConfigError: a field that cannot be used on the mesh.
    """
    if isinstance(orientation, int | float):
        return math.radians(orientation)
    vectors = cell_vectors(base, cells, orientation, 1.0).astype(np.float64)
    normals = unit(cells.normals.astype(np.float64))
    right = rightwards(normals)
    return np.arctan2(-dot(vectors, right), dot(vectors, np.cross(normals, right)))


def rightwards(normals: np.ndarray, turn: Turn = 0.0) -> np.ndarray:
    """Where the exemplar's right points on surfaces with unit normals (N, 3): +y x normal, turned; unit."""
    right = orthonormal(np.cross(np.array([0, 1, 0], normals.dtype), normals), normals)
    return unit(rotate_about(right, normals, turn))
