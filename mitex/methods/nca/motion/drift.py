"""Which way the texture shall move in one training step, on the surface that a state grows on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from mitex.mesh.fields import vector_field
from mitex.mesh.mesh import Mesh
from mitex.mesh.nearest import nearest_points
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.surface import Points
from mitex.methods.nca.surfaces import TrainingPlane, TrainingSphere, TrainingSurface


@dataclass(frozen=True, eq=False)
class Drift:
    """A tangent field on a training surface.

    Attributes:
        surface: the surface.
        field: (V, 3) float64 at its cells, in the mesh's space: 1 is an edge in the motion's period.
    """

    surface: TrainingSurface
    field: np.ndarray

    @property
    def condition(self) -> torch.Tensor:
        """What the cells know of it, (V, 3) (equation 10)."""
        return torch.from_numpy(self.field.astype(np.float32))

    def transport(self, share: float) -> Callable[[torch.Tensor], torch.Tensor]:
        """What a share of the period makes of a state (V, C): each cell gets that of the place upstream."""
        surface = self.surface
        if isinstance(surface, TrainingSphere):
            away = surface.mesh.vertices - share * surface.edge * self.field
            points, source = nearest_points(surface.mesh, away), np.arange(len(away))
        else:
            lattice = surface.lattice
            away = (lattice.mesh.vertices[: lattice.count] - share * self.field) @ surface.axes.T
            points, source = lattice.locate(away / lattice.columns), lattice.source
        where, spread = Points(*map(torch.from_numpy, points)), torch.from_numpy(source)
        return lambda state: surface.surface.read(surface.surface.table(state[spread]), where)


def draw_drift(config: NcaConfig, surface: TrainingSurface, generator: torch.Generator) -> Drift:
    """A drift of random speed, and of a random direction: a rule that has seen them all follows any field.

    On spheres it is the config's field, turned about a random axis if the config wants it; on flat squares,
    which a constant field alone repeats on, always a random direction.
    """
    low, high = config.motion_speeds
    speed = low + (high - low) * float(torch.rand((), generator=generator))
    if isinstance(surface, TrainingPlane):
        angle = 2 * math.pi * float(torch.rand((), generator=generator))
        direction = np.array([math.cos(angle), math.sin(angle)]) @ surface.axes
        return Drift(surface, np.tile(speed * direction, (surface.perception.vertices, 1)))
    rotation = random_rotation(generator) if config.motion_turns else np.eye(3)
    return Drift(surface, speed * turned_field(surface.mesh, config.motion, rotation))


def turned_field(mesh: Mesh, source: str, rotation: np.ndarray) -> np.ndarray:
    """(V, 3) float64, the field R U(R^T x) of a `vector_field` U and a rotation R."""
    return vector_field(mesh.with_vertices(mesh.vertices @ rotation), source) @ rotation.T


def random_rotation(generator: torch.Generator) -> np.ndarray:
    """A uniformly distributed rotation matrix (3, 3) float64."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(torch.randn(4, generator=generator, dtype=torch.float64).numpy()).as_matrix()
