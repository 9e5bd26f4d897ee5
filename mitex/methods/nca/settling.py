"""How long a look grows before its pattern is in order.

Cells go on changing after a texture has covered the surface, and faults in its order heal slowly: rows of
scales become straight over hundreds of steps. A pattern that is not meant to be regular becomes so in the end
too, and is best left earlier.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from mitex.evaluation.regularity import regularity
from mitex.exemplar import Exemplar
from mitex.methods.nca.look import Look
from mitex.methods.nca.motion.cell_motion import tile_motion
from mitex.methods.nca.ranges import REPEATS, square_cells
from mitex.methods.nca.surfaces import TrainingPlane

STEPS = (200, 500, 1000)
SIDE = 128  # of the exemplar when patterns are compared [px]


@torch.no_grad()
def settling_steps(
    look: Look, exemplar: Exemplar, density: float, about: Mapping[str, Any] | None = None
) -> int:
    """The fewest of `STEPS` after which the maps on a flat square are as regular as the exemplar's, on
    average; the most if they never are (`mitex.evaluation.regularity`).

    Args:
        look: a trained rule and decoder; one that moves is looked at while it moves to the right.
        exemplar: its maps.
        density: cells along the exemplar's width.
        about: what its file tells of how it moves.
    """
    maps = exemplar.resized(SIDE).maps
    goal = np.mean([regularity(maps[name]) for name in look.layout])
    plane = TrainingPlane.of(square_cells(density), look)
    generator = torch.Generator().manual_seed(0)
    motion = tile_motion(look, about or {}, plane.lattice, None, 1.0)
    inputs = motion.condition, motion.advection
    state, age = look.rule.seed(plane.perception), 0
    for steps in STEPS:
        state = look.evolve(state, plane.perception, steps - age, generator, *inputs)
        age = steps
        if _regularity(plane.whole(look, state[0], REPEATS * SIDE), look) >= goal:
            break
    return age


def _regularity(picture: torch.Tensor, look: Look) -> float:
    """Mean over the maps, and over the squares of the exemplar's size in a picture (H, W, C)."""
    values = picture.clamp(0, 1).numpy()
    squares = [
        values[top : top + SIDE, left : left + SIDE]
        for top in range(0, len(values), SIDE)
        for left in range(0, len(values), SIDE)
    ]
    return float(
        np.mean([regularity(square[..., list(c)]) for square in squares for c in look.layout.values()])
    )
