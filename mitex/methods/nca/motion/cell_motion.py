"""How the cells of a texture move along a vector field: their conditions, and what carries them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.mesh import Lattice, Mesh
from mitex.methods.nca.look import Look
from mitex.methods.nca.motion.advection import Advection, advection, flat_advection
from mitex.methods.nca.motion.condition import WIDTH, Field, cell_vectors, conditions, flat_vectors
from mitex.methods.nca.ranges import SPEEDS

# Steps in which a texture that was not trained to move goes an edge, where the field has length 1.
PERIOD = 6.0
LONGEST = 3.0  # vectors along which its pattern still heals as fast as it is drawn out


@dataclass(frozen=True, eq=False)
class CellMotion:
    """How the cells of one mesh move.

    Attributes:
        condition: of the cells, (V, 3) (MeshNCA, equation 10); None for none.
        advection: what carries their states in each step; None for nothing.
    """

    condition: torch.Tensor | None = None
    advection: Advection | None = None

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """What it consists of, for hashes."""
        arrays = [] if self.condition is None else [self.condition]
        if self.advection is not None:
            arrays += [self.advection.upstream.face, self.advection.upstream.barycentric]
        return tuple(array.numpy() for array in arrays)


STILL = CellMotion()


def look_motion(
    look: Look,
    about: Mapping[str, Any],
    base: Mesh,
    cells: Mesh,
    field: Field | None,
    speed: float,
    orientation: float | np.ndarray = 0.0,
) -> CellMotion:
    """How a look's cells move on a mesh; other arguments as of `cell_vectors`.

    Args:
        look: the cell rule.
        about: what its file tells of how it moves.
        orientation: of the texture [rad], one or (V,) at the cells.

    Raises:
        ConfigError: as of `motion_field` and `vector_field`.
        MeshError: as of `vector_field`.
    """
    field = motion_field(look, about, field, speed, about.get("motion"))
    if field is None:
        return STILL
    vectors = cell_vectors(base, cells, field, speed, longest=fastest(about)).astype(np.float64)
    displacement = cells.edge_lengths[:, None] * vectors / period(about)
    return CellMotion(
        torch.from_numpy(conditions(vectors, cells, orientation)) if look.rule.condition else None,
        advection(cells, displacement) if is_advected(look, about) else None,
    )


def tile_motion(
    look: Look, about: Mapping[str, Any], lattice: Lattice, field: Field | None, speed: float
) -> CellMotion:
    """How a look's cells move in a lattice's square, to the right if it has learned to move and no field is
    given.

    Raises:
        ConfigError: as of `motion_field` and `flat_vectors`.
    """
    default = "right" if look.rule.condition or "motion" in about else None
    field = motion_field(look, about, field, speed, default)
    if field is None:
        return STILL
    vectors = flat_vectors(lattice, field, speed, fastest(about))
    return CellMotion(
        torch.from_numpy(vectors) if look.rule.condition else None,
        flat_advection(lattice, vectors[:, :2] / period(about)) if is_advected(look, about) else None,
    )


def is_advected(look: Look, about: Mapping[str, Any]) -> bool:
    """Whether the states of a texture are carried along a field: those that were trained so, and those that
    were not trained to move.
    """
    return bool(about.get("motion_advection", "motion" not in about and not look.rule.condition))


def follows_fields(look: Look, about: Mapping[str, Any]) -> bool:
    """Whether a texture moves along any vector field, rather than in the way that it was trained alone."""
    return bool(look.rule.condition) or is_advected(look, about)


def period(about: Mapping[str, Any]) -> float:
    """Steps in which the pattern of a texture goes an edge, where the field has length 1."""
    steps = about.get("motion_period")
    return float(steps) if isinstance(steps, int | float) and steps >= 1 else PERIOD


def fastest(about: Mapping[str, Any]) -> float:
    """Length of the longest vectors that a texture can follow: its training's, if that had any."""
    speed = about.get("motion_speed")
    if isinstance(speed, int | float) and speed > 0:
        return float(speed)
    return math.inf if "motion" in about else LONGEST


def motion_field(
    look: Look, about: Mapping[str, Any], field: Field | None, speed: float, default: Field | None
) -> Field | None:
    """The vector field that a look follows: the given one or the default; None if it shall not move.

    Raises:
        ConfigError: it cannot follow the field, or needs one; or a speed out of range, or of nothing.
    """
    name, width = about.get("name", "the model"), look.rule.condition
    if not SPEEDS[0] <= speed <= SPEEDS[1]:
        raise ConfigError(f"a speed of {speed:g}", f"use {SPEEDS[0]:g} to {SPEEDS[1]:g}")
    if not follows_fields(look, about):
        if field is None and speed == 1.0:
            return None
        raise ConfigError(
            f"'{name}' moves in its own way alone", "train one with motion_encoding or motion_advection"
        )
    field = default if field is None else field
    if width not in (0, WIDTH) or (width and field is None):
        raise ConfigError(
            f"'{name}' needs a condition of {width} values at each vertex, and has none here",
            "give `field`" if width == WIDTH else "give it to MeshNCA.evolve in Python",
        )
    if field is None and speed != 1.0:
        raise ConfigError(f"'{name}' stands still, so that a speed means nothing", "give `field` too")
    return field
