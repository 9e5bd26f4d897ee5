"""The spheres that a rule is trained on."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from mitex.mesh import Mesh, icosphere, scattered_sphere
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.surface import Surface
from mitex.methods.nca.look import Look
from mitex.methods.nca.perception import Perception, perception
from mitex.methods.nca.views import render_views
from mitex.scenes.cameras import Cameras
from mitex.scenes.stage import Stage


@dataclass(frozen=True, eq=False)
class TrainingSphere:
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
    def of(mesh: Mesh, look: Look) -> TrainingSphere:
        """For a look's rule and decoder."""
        operator = perception(mesh, look.rule.degree, mean=look.mean)
        return TrainingSphere(mesh, operator, Surface(mesh, look.interpolation), Stage(mesh))

    def views(self, look: Look, state: torch.Tensor, cameras: Cameras, antialias: int = 1) -> torch.Tensor:
        """Images (K, H, W, C) of a state (V, C); see `render_views`."""
        return render_views(look.decoder, state, self.surface, self.stage, cameras, antialias)


def training_spheres(config: NcaConfig, look: Look) -> list[TrainingSphere]:
    """The training's spheres, all with as many vertices: states of the pool grow on them in turns."""
    meshes = []
    if config.sphere in ("even", "both"):
        meshes.append(icosphere(config.frequency))
    if config.sphere in ("uneven", "both"):
        meshes.append(scattered_sphere(10 * config.frequency**2 + 2, config.seed))
    return [TrainingSphere.of(mesh, look) for mesh in meshes]
