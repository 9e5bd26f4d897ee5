"""What a vision-language model is shown: a textured surface, and the same without its texture."""

from __future__ import annotations

from dataclasses import dataclass

import torch
import torch.nn.functional as F

from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.surface import Points
from mitex.methods.nca.displacement import Displacement
from mitex.methods.nca.look import Look
from mitex.methods.nca.surfaces import LEAST, CloseUps, TrainingMesh
from mitex.scenes.cameras import Cameras, random_views
from mitex.scenes.shaded import GREY, lamps_of_pixels, pictured, shading
from mitex.sparse import Weights


def training_cameras(
    config: NcaConfig, surface: TrainingMesh, generator: torch.Generator, least: int = LEAST
) -> Cameras:
    """Random views of a step: of the whole surface, or of patches as wide as the density, of `least` pixels
    a side or more."""
    count, resolution = config.view_count, config.resolution
    if config.views == "patch":
        return surface.cameras(CloseUps(config.density, count, resolution, least=least), generator)
    distances = config.text_distances
    distance = distances[int(torch.randint(len(distances), (), generator=generator))]
    return random_views(generator, count, distance, config.fov, resolution)


@dataclass(frozen=True, eq=False)
class Views:
    """Pictures of a textured surface (K, H, W, 3), sRGB, and what they were made from.

    Attributes:
        coloured: with its colours and its relief.
        plain: grey, with its relief.
        values: (P, C) of the maps where the pixels meet the surface.
        height: (V,) of the vertices.
    """

    coloured: torch.Tensor
    plain: torch.Tensor
    values: torch.Tensor
    height: torch.Tensor


class Figure:
    """A surface as cameras see it, shaded.

    Args:
        surface: the surface.
        bound: of the relief [edges].
        device: of states.
    """

    def __init__(self, surface: TrainingMesh, bound: float, device: torch.device | str = "cpu") -> None:
        self.surface, self.relief = surface, Displacement(surface.mesh, bound, device)
        self._faces = torch.tensor(surface.mesh.faces, device=device)

    def bare(self, cameras: Cameras) -> torch.Tensor:
        """Pictures (K, H, W, 3) without any texture, grey and even."""
        hit, points = self._visible(cameras)
        return pictured(GREY * self._shade(self.relief.plain, points, hit, cameras), hit, cameras)

    def textured(self, look: Look, state: torch.Tensor, cameras: Cameras) -> Views:
        """With what a state (V, C) shows; differentiable in the state and the look's decoder."""
        hit, points = self._visible(cameras)
        surface, layout = self.surface.surface, look.layout
        table = surface.table(state)
        values, corners = (look.decoder(surface, table, where) for where in (points, self.relief.corners))
        height = corners[:, layout["height"][0]]
        shade = self._shade(self.relief.normals(height), points, hit, cameras)
        coloured = shade * values[:, list(layout["albedo"])].clamp(0, 1)
        plain = shade * GREY
        return Views(pictured(coloured, hit, cameras), pictured(plain, hit, cameras), values, height)

    def _visible(self, cameras: Cameras) -> tuple[torch.Tensor, Points]:
        """Which pixels meet the surface, (K H W,) bool, and where."""
        hits = self.surface.stage.hits(cameras)
        return hits.hit.to(self._faces.device), Points(hits.face, hits.barycentric)

    def _shade(
        self, normals: torch.Tensor, points: Points, hit: torch.Tensor, cameras: Cameras
    ) -> torch.Tensor:
        """The light (P, 1) at points, between the normals of the vertices (V, 3)."""
        device = self._faces.device
        corners, weights = self._faces[points.face.long().to(device)], points.barycentric.to(device)
        between = F.normalize(Weights(corners, weights, len(normals))(normals), dim=1)
        return shading(between, lamps_of_pixels(cameras, hit))
