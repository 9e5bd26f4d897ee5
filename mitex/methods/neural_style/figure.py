"""Pictures of a mesh whose vertices move, through shading differentiable in colours and positions."""

from __future__ import annotations

import torch
import torch.nn.functional as F

from mitex.bridge import lookup
from mitex.mesh import Mesh
from mitex.scenes.cameras import Cameras
from mitex.scenes.shaded import BACKGROUND, GREY, lamps_of_pixels, pictured, shading
from mitex.scenes.stage import Stage


class Figure:
    """A mesh, as a vision-language model is shown it.

    What the cameras see is traced on the moved surface, outline and all, without derivatives; gradients reach
    the vertices through the normals that the surface is shaded with.

    Args:
        mesh: whose faces stay.
        background: sRGB around it; white by default.
    """

    def __init__(self, mesh: Mesh, background: float = BACKGROUND) -> None:
        self._background = background
        self.stage, self._faces = Stage(mesh), torch.tensor(mesh.faces, dtype=torch.int64)

    def pictures(
        self, cameras: Cameras, vertices: torch.Tensor, colours: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Pictures (K, H, W, 3) sRGB with these colours, and in grey.

        Args:
            cameras: K views.
            vertices: (V, 3) float32 positions.
            colours: (V, 3) sRGB in [0, 1], between which faces interpolate.
        """
        self.stage.move(vertices.detach().numpy())
        visibility = self.stage.visibility(cameras)
        field = torch.cat([colours, smooth_normals(vertices, self._faces)], 1)
        hit = visibility.coverage.flatten() > 0
        values = lookup(field, visibility).flatten(0, 2)[hit]
        shade = shading(F.normalize(values[:, 3:], dim=1), lamps_of_pixels(cameras, hit))
        coloured = pictured(shade * values[:, :3], hit, cameras, self._background)
        return coloured, pictured(GREY * shade, hit, cameras, self._background)


def smooth_normals(vertices: torch.Tensor, faces: torch.Tensor) -> torch.Tensor:
    """(V, 3) unit normals, the area-weighted mean of the faces around, as `Mesh.normals`; differentiable.

    Args:
        vertices: (V, 3).
        faces: (F, 3) int64.
    """
    a, b, c = vertices[faces].unbind(1)
    crosses = torch.linalg.cross(b - a, c - a).repeat_interleave(3, 0)
    return F.normalize(torch.zeros_like(vertices).index_add(0, faces.flatten(), crosses), dim=1)
