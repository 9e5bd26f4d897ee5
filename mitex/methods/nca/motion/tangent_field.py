"""Which way the texture shall move in one training step, on the surface that a state grows on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch

from mitex.geometry.triangles import interpolate, scattered
from mitex.mesh.fields import vector_field
from mitex.mesh.mesh import Mesh
from mitex.mesh.nearest import nearest_points
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.surface import Points
from mitex.methods.nca.motion.advection import Advection, as_points
from mitex.methods.nca.surfaces import TrainingMesh, TrainingPlane, TrainingSurface


@dataclass(frozen=True, eq=False)
class TangentField:
    """A tangent field on a training surface.

    Attributes:
        surface: the surface.
        vectors: (V, 3) float64 at its cells, in the mesh's space: 1 is an edge in the motion's period.
    """

    surface: TrainingSurface
    vectors: np.ndarray

    @property
    def condition(self) -> torch.Tensor:
        """What the cells know of it, (V, 3) float32 [edges a period] (equation 10)."""
        return torch.from_numpy(self.vectors.astype(np.float32))

    def advection(self, share: float) -> Advection:
        """What a share of the period makes of states: each cell gets that of the place upstream, as many
        edges away as the vector is long there, times the share.
        """
        surface = self.surface
        source = surface.lattice.source if isinstance(surface, TrainingPlane) else None
        return Advection(surface.surface, self._upstream(self._cells, self.vectors, share), source)

    def table(self, state: torch.Tensor) -> torch.Tensor:
        """What the decoder reads of a state (V, C)."""
        surface = self.surface
        if isinstance(surface, TrainingPlane):
            state = state[torch.from_numpy(surface.lattice.source)]
        return surface.surface.table(state)

    def random_places(self, count: int, share: float, generator: torch.Generator) -> tuple[Points, Points]:
        """Random points of the surface, and where what is there was a share of the period before."""
        mesh = self._mesh
        numbers = torch.rand(count, 3, generator=generator, dtype=torch.float64).numpy()
        face, weights = scattered(mesh.face_areas, numbers.T)
        corners = mesh.faces[face]
        vectors = self.vectors
        if isinstance(self.surface, TrainingPlane):
            vectors = vectors[self.surface.lattice.source]
        places = interpolate(weights, mesh.vertices[corners].astype(np.float64))
        before = self._upstream(places, interpolate(weights, vectors[corners]), share)
        return as_points(face, weights), before

    @property
    def _mesh(self) -> Mesh:
        surface = self.surface
        return surface.mesh if isinstance(surface, TrainingMesh) else surface.lattice.mesh

    @property
    def _cells(self) -> np.ndarray:
        return self._mesh.vertices[: len(self.vectors)].astype(np.float64)

    def _upstream(self, places: np.ndarray, vectors: np.ndarray, share: float) -> Points:
        """Where what is at places (P, 3) was before, given the vectors there (P, 3)."""
        surface = self.surface
        if isinstance(surface, TrainingMesh):
            return as_points(*nearest_points(surface.mesh, places - share * surface.edge * vectors))
        columns = surface.lattice.columns
        return as_points(*surface.lattice.locate((places - share * vectors) @ surface.axes.T / columns))


def random_field(config: NcaConfig, surface: TrainingSurface, generator: torch.Generator) -> TangentField:
    """A field of random speed, and of a random direction: a rule that has seen them all follows any field.

    On spheres it is the config's field, turned about a random axis if the config wants it; on flat squares,
    which a constant field alone repeats on, always a random direction.
    """
    low, high = config.motion_speeds
    speed = low + (high - low) * float(torch.rand((), generator=generator))
    if isinstance(surface, TrainingPlane):
        angle = 2 * math.pi * float(torch.rand((), generator=generator))
        direction = np.array([math.cos(angle), math.sin(angle)]) @ surface.axes
        return TangentField(surface, np.tile(speed * direction, (surface.perception.vertices, 1)))
    rotation = random_rotation(generator) if config.motion_turns else np.eye(3)
    assert config.motion is not None
    return TangentField(surface, speed * turned_field(surface.mesh, config.motion, rotation))


def turned_field(mesh: Mesh, source: str, rotation: np.ndarray) -> np.ndarray:
    """(V, 3) float64, the field R U(R^T x) of a `vector_field` U and a rotation R."""
    return vector_field(mesh.with_vertices(mesh.vertices @ rotation), source) @ rotation.T


def random_rotation(generator: torch.Generator) -> np.ndarray:
    """A uniformly distributed rotation matrix (3, 3) float64."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(torch.randn(4, generator=generator, dtype=torch.float64).numpy()).as_matrix()
