"""The surfaces that a rule is trained on: spheres, and flat squares that repeat.

Spheres teach the rule what curved and uneven meshes are like. A pattern in rows fits on none of them without
faults, and their patches show it foreshortened; on a flat square it can be as regular as the exemplar.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import torch

from mitex.geometry.vectors import rotate_about
from mitex.mesh import Lattice, Mesh, icosphere, scattered_sphere
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.surface import Points, Surface
from mitex.methods.nca.look import Look
from mitex.methods.nca.perception import Perception, lattice_perception, perception
from mitex.methods.nca.ranges import square_cells
from mitex.methods.nca.views import render_views
from mitex.scenes.cameras import Cameras, orbit, patch_views
from mitex.scenes.stage import Stage

WIDEST = 0.65  # half the side of a patch of the unit sphere: wider ones would look past it
LEAST = 16  # pixels along a view, which the features need


@dataclass(frozen=True)
class CloseUps:
    """Pictures of parts of a surface.

    Attributes:
        width: of what each one shows [edges]; where the surface is too small, it shows less, in fewer pixels.
        count: K.
        resolution: height and width of each [px].
        antialias: n for n x n samples in each pixel.
        least: pixels that are not fewer even where less is shown.
    """

    width: float
    count: int
    resolution: int
    antialias: int = 1
    least: int = LEAST

    def pixels(self, share: float) -> int:
        """Along a picture of a share of the width."""
        return max(round(share * self.resolution), min(self.least, self.resolution))


@dataclass(frozen=True, eq=False)
class TrainingMesh:
    """A mesh on which states grow and are seen.

    Attributes:
        mesh: the mesh.
        perception: of its cells.
        surface: for the decoder.
        stage: for cameras.
    """

    mesh: Mesh
    perception: Perception
    surface: Surface
    stage: Stage

    @staticmethod
    def of(mesh: Mesh, look: Look) -> TrainingMesh:
        """For a look's rule and decoder."""
        operator = perception(mesh, look.rule.degree, device=look.device, mean=look.mean)
        return TrainingMesh(mesh, operator, Surface(mesh, look.interpolation, look.device), Stage(mesh))

    @property
    def edge(self) -> float:
        """Length of the edges [mesh units], of as many equilateral faces on the same area."""
        area = float(self.mesh.face_areas.sum(dtype=np.float64))
        return math.sqrt(2 * area / math.sqrt(3) / len(self.mesh.vertices))

    def views(self, look: Look, state: torch.Tensor, cameras: Cameras, antialias: int = 1) -> torch.Tensor:
        """Images (K, H, W, C) of a state (V, C); see `render_views`."""
        return render_views(look.decoder, state, self.surface, self.stage, cameras, antialias)

    def patches(
        self, look: Look, state: torch.Tensor, closeups: CloseUps, generator: torch.Generator
    ) -> torch.Tensor:
        """Close-ups (K, H, W, C) of a state (V, C) at random places."""
        return self.views(look, state, self.cameras(closeups, generator), closeups.antialias)

    def cameras(self, closeups: CloseUps, generator: torch.Generator) -> Cameras:
        """Of `patches`."""
        half = 0.5 * closeups.width * self.edge
        share = min(WIDEST / half, 1.0)
        return patch_views(generator, self.mesh, closeups.count, share * half, closeups.pixels(share))

    def whole(self, look: Look, state: torch.Tensor, resolution: int) -> torch.Tensor:
        """The mesh as a camera sees it, (H, W, C)."""
        return self.views(look, state, orbit(1, distance=2.05, resolution=resolution), antialias=2)[0]


@dataclass(frozen=True, eq=False)
class Windows:
    """Squares of a flat square.

    Attributes:
        corners: (K, 2) float64, lower left ones, x and y [periods].
        width: of each [periods].
        pixels: height and width of each [px].
        antialias: n for n x n samples in each pixel.
    """

    corners: np.ndarray
    width: float
    pixels: int
    antialias: int = 1


@dataclass(frozen=True, eq=False)
class TrainingPlane:
    """A flat square on which states grow, its opposite sides joined.

    Attributes:
        lattice: the cells' places.
        perception: of the cells in the square.
        surface: of the lattice's mesh, for the decoder.
    """

    lattice: Lattice
    perception: Perception
    surface: Surface

    @staticmethod
    def of(columns: int, look: Look, azimuth: float = 0.0) -> TrainingPlane:
        """With `columns` cells along a side, up +y, and facing +z turned about +y by `azimuth` [rad]."""
        lattice = Lattice.of(columns)
        axes = np.broadcast_to(np.array([0.0, 1.0, 0.0]), lattice.mesh.vertices.shape)
        vertices = rotate_about(lattice.mesh.vertices.astype(np.float64), axes, azimuth)
        lattice = replace(lattice, mesh=lattice.mesh.with_vertices(vertices))
        operator = lattice_perception(lattice, look.rule.degree, look.mean, look.device)
        return TrainingPlane(lattice, operator, Surface(lattice.mesh, look.interpolation, look.device))

    @property
    def axes(self) -> np.ndarray:
        """(2, 3) float64 unit vectors to the right and up in the square, in the space of the mesh."""
        origin, right = self.lattice.mesh.vertices[:2].astype(np.float64)
        return np.stack([right - origin, [0.0, 1.0, 0.0]])

    def patches(
        self, look: Look, state: torch.Tensor, closeups: CloseUps, generator: torch.Generator
    ) -> torch.Tensor:
        """As of `TrainingMesh`; within the square, as the decoder's waves do not repeat."""
        return self.windows(look, state, self.places(closeups, generator))

    def places(self, closeups: CloseUps, generator: torch.Generator) -> Windows:
        """The windows of `patches`."""
        periods = closeups.width / self.lattice.columns
        share = min(1 / periods, 1.0)
        width = share * periods
        corners = torch.rand(closeups.count, 2, generator=generator, dtype=torch.float64).numpy()
        return Windows(corners * (1 - width), width, closeups.pixels(share), closeups.antialias)

    def whole(self, look: Look, state: torch.Tensor, resolution: int) -> torch.Tensor:
        """All of the square, (H, W, C)."""
        return self.windows(look, state, Windows(np.zeros((1, 2)), 1.0, resolution, 2))[0]

    def windows(self, look: Look, state: torch.Tensor, windows: Windows) -> torch.Tensor:
        """Images (K, H, W, C) of a state (V, C) in windows."""
        resolution, antialias = windows.pixels, windows.antialias
        samples = resolution * antialias
        steps = (np.arange(samples) + 0.5) * (windows.width / samples)
        grid = np.stack(np.meshgrid(steps, steps[::-1]), axis=2)
        face, barycentric = self.lattice.locate((windows.corners[:, None, None] + grid).reshape(-1, 2))
        points = Points(torch.from_numpy(face), torch.from_numpy(barycentric))
        table = self.surface.table(state[torch.from_numpy(self.lattice.source)])
        values = look.decoder(self.surface, table, points)
        sides = (len(windows.corners), resolution, antialias, resolution, antialias, -1)
        return values.view(sides).mean((2, 4))


TrainingSurface = TrainingMesh | TrainingPlane


def training_surfaces(config: NcaConfig, look: Look) -> list[TrainingSurface]:
    """The surfaces that states of the pool grow on in turns; each further plane faces another way."""
    surfaces: list[TrainingSurface] = []
    planes = 0
    for kind in config.surfaces:
        if kind == "flat":
            columns = square_cells(config.density)
            surfaces.append(TrainingPlane.of(columns, look, 0.5 * math.pi * planes))
            planes += 1
        elif kind == "even":
            surfaces.append(TrainingMesh.of(icosphere(config.frequency), look))
        else:
            mesh = scattered_sphere(10 * config.frequency**2 + 2, config.seed)
            surfaces.append(TrainingMesh.of(mesh, look))
    return surfaces
