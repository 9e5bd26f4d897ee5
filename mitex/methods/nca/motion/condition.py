"""What the cells of a moving texture are told of a vector field on a mesh (MeshNCA, equation 10)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
import torch

from mitex.errors import ConfigError, TextureWarning
from mitex.geometry.vectors import rotate_about
from mitex.mesh import Lattice, Mesh
from mitex.mesh.fields import carried_field, vector_field
from mitex.methods.nca.look import Look
from mitex.methods.nca.ranges import SPEEDS

WIDTH = 3  # of a vector, which is a cell's condition
FEW = 0.1  # of the vectors, which may be too fast

Field = str | Path | np.ndarray
"""A vector field, as `mitex.mesh.fields.vector_field` takes it."""


class Motion(TypedDict, total=False):
    """How a moving texture moves.

    Attributes:
        field: the vector field that it follows; None for the one that it was trained with.
        speed: factor of the field, whose mean length is 1.
    """

    field: Field | None
    speed: float


def look_condition(
    look: Look,
    about: Mapping[str, Any],
    given: Mesh,
    cells: Mesh,
    field: Field | None,
    speed: float,
    orientation: float | np.ndarray = 0.0,
) -> torch.Tensor | None:
    """The condition (V, 3) of a look's cells on a mesh, None if it does not move; as of `cell_vectors`."""
    field = followed_field(look, about, field, speed, about.get("motion"))
    if field is None:
        return None
    return torch.from_numpy(cell_vectors(given, cells, field, speed, orientation, fastest(about)))


def tile_condition(
    look: Look, about: Mapping[str, Any], lattice: Lattice, field: Field | None, speed: float
) -> torch.Tensor | None:
    """The condition (V, 3) of a look's cells in a lattice's square, None if it does not move; to the right if
    no field is given; errors as of `flat_vectors`.
    """
    field = followed_field(look, about, field, speed, "right")
    return None if field is None else torch.from_numpy(flat_vectors(lattice, field, speed, fastest(about)))


def fastest(about: Mapping[str, Any]) -> float:
    """Length of the longest vectors that the training of a texture had."""
    speed = about.get("motion_speed")
    return speed if isinstance(speed, int | float) and speed > 0 else math.inf


def cell_vectors(
    given: Mesh,
    cells: Mesh,
    field: Field,
    speed: float,
    orientation: float | np.ndarray = 0.0,
    longest: float = math.inf,
) -> np.ndarray:
    """(V, 3) float32 vectors of the cells.

    Args:
        given: the mesh whose vertices the vectors of a file or an array belong to.
        cells: V vertices; the same mesh, or one of nearly the same surface.
        field: see `Field`.
        speed: factor of the field, whose mean length is 1.
        orientation: of the texture [rad], one or (V,). Cells take what is turned by it for upright, so their
            vectors are turned back.
        longest: length of the longest vectors, see `slowed`.

    Raises:
        ConfigError: as of `vector_field`.
    """
    vectors = slowed(speed * carried_field(given, cells, field).astype(np.float64), longest)
    return rotate_about(vectors, cells.normals.astype(np.float64), -orientation).astype(np.float32)


def slowed(vectors: np.ndarray, longest: float) -> np.ndarray:
    """The vectors (V, 3), none longer than `longest`: a pattern that is told to move faster than it has
    learned stands still.

    Warns:
        TextureWarning: more than `FEW` of them were longer.
    """
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    share = (lengths > longest).mean()
    if share > FEW:
        warnings.warn(
            f"{share:.0%} of the vector field is faster than the texture has learned to move, and was slowed "
            "down; take a lower speed, and more steps between two frames",
            TextureWarning,
            stacklevel=5,
        )
    return vectors * np.minimum(1.0, longest / np.maximum(lengths, 1e-12))


def flat_vectors(lattice: Lattice, field: Field, speed: float, longest: float = math.inf) -> np.ndarray:
    """(V, 3) float32 vectors of the cells in a lattice's square, all the same.

    Raises:
        ConfigError: a field that differs from place to place; or as of `vector_field`.
    """
    vectors = speed * vector_field(lattice.mesh, field)[: lattice.count]
    if np.ptp(vectors, axis=0).max() > 1e-4 * speed:
        raise ConfigError(
            f"the vector field '{field}' is not the same everywhere, so that a tile would have a seam",
            "give a direction such as right or 1,1,0",
        )
    return slowed(vectors, longest)


def followed_field(
    look: Look, about: Mapping[str, Any], field: Field | None, speed: float, default: Field | None
) -> Field | None:
    """The vector field that a look follows: the given one or the default; None if the look does not move.

    Raises:
        ConfigError: it does not move but shall; no field is known; or a speed out of range.
    """
    name, width = about.get("name", "the model"), look.rule.condition
    if not SPEEDS[0] <= speed <= SPEEDS[1]:
        raise ConfigError(f"a speed of {speed:g}", f"use {SPEEDS[0]:g} to {SPEEDS[1]:g}")
    if not width:
        if field is None and speed == 1.0:
            return None
        if "motion" in about:
            raise ConfigError(f"'{name}' moves in its own way alone", "train one with motion_encoding=true")
        raise ConfigError(
            f"'{name}' does not move: it was trained without a vector field",
            "train one from it: fit nca with `motion` and `init`",
        )
    field = default if field is None else field
    if width != WIDTH or field is None:
        raise ConfigError(
            f"'{name}' needs a condition of {width} values at each vertex, and has none here",
            "give `field`" if width == WIDTH else "give it to MeshNCA.evolve in Python",
        )
    return field
