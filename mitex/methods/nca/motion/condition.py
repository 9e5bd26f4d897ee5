"""The conditions of a moving texture's cells: vectors of a field on a mesh (MeshNCA, equation 10)."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import TypedDict

import numpy as np

from mitex.errors import ConfigError, TextureWarning
from mitex.geometry.vectors import rotate_about
from mitex.mesh import Lattice, Mesh
from mitex.mesh.fields import carried_field, vector_field
from mitex.suffixes import names_field_file

WIDTH = 3  # of a vector, which is a cell's condition
FEW = 0.1  # of the vectors, which may be too fast

Field = str | Path | np.ndarray
"""A vector field, as `mitex.mesh.fields.vector_field` takes it."""


class Motion(TypedDict, total=False):
    """How a moving texture moves.

    Attributes:
        field: the vector field that it follows; None for the one that it was trained with, if any.
        speed: factor of the field, whose mean length is 1.
    """

    field: Field | None
    speed: float


def cell_vectors(
    base: Mesh,
    cells: Mesh,
    field: Field,
    speed: float,
    longest: float = math.inf,
) -> np.ndarray:
    """(V, 3) float32 vectors at the cells of a texture that is not turned; else see `conditions`.

    Args:
        base: the mesh whose vertices the vectors of a file or an array belong to.
        cells: V vertices; the same mesh, or one of nearly the same surface.
        field: see `Field`.
        speed: factor of the field, whose mean length is 1.
        longest: length of the longest vectors, see `clamp_lengths`.

    Raises:
        ConfigError: as of `vector_field`.
    """
    vectors = speed * carried_field(base, cells, field).astype(np.float64)
    return clamp_lengths(vectors, longest).astype(np.float32)


def conditions(vectors: np.ndarray, cells: Mesh, orientation: float | np.ndarray) -> np.ndarray:
    """(V, 3) float32, the conditions of a turned texture's cells.

    Args:
        vectors: (V, 3) of the field at the cells.
        cells: the mesh of the V cells.
        orientation: of the texture [rad], one or (V,). Cells take what is turned by it for upright, so their
            vectors are turned back.
    """
    return rotate_about(vectors, cells.normals.astype(np.float64), -orientation).astype(np.float32)


def clamp_lengths(vectors: np.ndarray, longest: float) -> np.ndarray:
    """The vectors (V, 3), none longer than `longest`: a pattern that is told to move faster than it has
    learned stands still, and one that is carried faster than it heals dissolves.

    Warns:
        TextureWarning: more than `FEW` of them were longer.
    """
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    share = (lengths > longest).mean()
    if share > FEW:
        warnings.warn(
            f"{share:.0%} of the vector field is faster than the texture can follow, and was slowed down; "
            "take a lower speed, and more steps between two frames",
            TextureWarning,
            stacklevel=5,
        )
    return vectors * np.minimum(1.0, longest / np.maximum(lengths, 1e-12))


def flat_vectors(lattice: Lattice, field: Field, speed: float, longest: float = math.inf) -> np.ndarray:
    """(V, 3) float32 vectors of the cells in a lattice's square, all the same.

    Raises:
        ConfigError: a field that differs from place to place, or that of one mesh; or as of `vector_field`.
    """
    if names_field_file(field):
        raise ConfigError(
            f"the vector field '{field}' is that of a mesh",
            "a tile takes one direction, such as right or 1,1,0",
        )
    vectors = speed * vector_field(lattice.mesh, field)[: lattice.count]
    if np.ptp(vectors, axis=0).max() > 1e-4 * speed:
        raise ConfigError(
            f"the vector field '{field}' is not the same everywhere, so that a tile would have a seam",
            "a tile takes one direction, such as right or 1,1,0",
        )
    return clamp_lengths(vectors, longest)
