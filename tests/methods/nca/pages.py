"""What the living page computes, in Python: states with the page's masks, and what its pixels show."""

from collections.abc import Iterator

import numpy as np
import torch

from mitex.geometry.vectors import unit
from mitex.mesh import Mesh
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.motion.cell_motion import STILL, CellMotion
from mitex.methods.nca.orientation import Turn
from mitex.methods.nca.perception import perception
from tests.page.hashes import mask


def states(
    texture: NcaTexture, mesh: Mesh, seed: int = 0, turn: Turn = 0.0, motion: CellMotion = STILL
) -> Iterator[torch.Tensor]:
    """The states (V, C) after each step, of cells that move."""
    look = texture.look
    operator = perception(mesh, look.rule.degree, turn, mean=look.mean)
    values, step = look.rule.seed(operator), 0
    while True:
        fires = torch.from_numpy(mask(len(mesh.vertices), step, seed))
        with torch.no_grad():
            values = look.clamp(look.rule.step(values, operator, fires, motion.condition))
            values = values if motion.advection is None else motion.advection(values)
        step += 1
        yield values[0]


def after(steps: int, states: Iterator[torch.Tensor]) -> torch.Tensor:
    """The state (V, C) after some more steps."""
    return [next(states) for _ in range(steps)][-1]


def points(ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces (P,) and barycentrics (P, 3) in the page's ids (P, 4)."""
    bits = ids[:, 1:3].copy().view(np.float32)
    return ids[:, 0].astype(np.int32) - 1, np.column_stack([bits, 1 - bits.sum(1)])


def shown(
    texture: NcaTexture, state: torch.Tensor, mesh: Mesh, turn: Turn, ids: np.ndarray
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The maps, and the normals (P, 3), at pixels that see the surface."""
    grown = GrownTexture(texture.look, state, Cells(mesh, 0, mesh), turn, texture._palette)
    face, barycentric = points(ids)
    maps = grown.maps(grown.values(face, barycentric))
    return maps, unit(grown.object_normals(maps["normal"], face, barycentric))
