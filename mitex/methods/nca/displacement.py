"""The relief of a look from words: its height moves the surface along the normals.

A step of a training shades the surface with the normals that it would have then, and moves nothing: what the
cameras see stays where it is, and is traced without gradients. The outline of the training's sphere would
change by a few pixels.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F

from mitex.mesh import Mesh
from mitex.mesh.gradients import values_and_gradients
from mitex.methods.nca.decoder.surface import EDGE, decoder_units, vertex_points
from mitex.sparse import LinearMap


class Displacement:
    """Heights of a mesh's V vertices as a relief.

    Args:
        mesh: the mesh.
        bound: how far the surface is moved at most [mean edges of the mesh], everywhere or (V,).
        device: of the heights.
    """

    def __init__(self, mesh: Mesh, bound: float | np.ndarray, device: torch.device | str = "cpu") -> None:
        bounds = np.asarray(bound * EDGE * decoder_units(mesh).scale)
        self.bound = float(bounds.max())
        self._bounds = torch.tensor(bounds.astype(np.float32), device=device)
        self.corners = vertex_points(mesh)
        self.plain = torch.tensor(mesh.normals, device=device)
        rows = values_and_gradients(mesh)
        derivatives = np.arange(rows.shape[0]) % 4 != 0
        self._gradient = LinearMap(rows[derivatives], device)

    def offsets(self, height: torch.Tensor) -> torch.Tensor:
        """How far heights (V,) move the vertices outwards [mesh units]: by the bound at 1, not at 0.5, as far
        inwards at 0; heights beyond count as these.
        """
        return self._bounds * (2 * height.clamp(0, 1) - 1)

    def slopes(self, height: torch.Tensor) -> torch.Tensor:
        """The gradients (V, 3) of the offsets along the surface, which the normals lean back by."""
        gradient = self._gradient(self.offsets(height)[:, None]).view(-1, 3)
        return gradient - self.plain * (self.plain * gradient).sum(1, keepdim=True)

    def normals(self, height: torch.Tensor) -> torch.Tensor:
        """Unit normals (V, 3) of the moved surface: n - grad d, normalised, which neglects d beside the radii
        of the surface's curvature (Blinn 1978). Differentiable in the heights.
        """
        return F.normalize(self.plain - self.slopes(height), dim=1)


def known_relief(about: Mapping[str, Any], maps: Container[str]) -> float:
    """The bound of a texture's relief [edges], as its file tells; 0 if its height is a map and no more."""
    bound = about.get("relief")
    return float(bound) if isinstance(bound, int | float) and bound > 0 and "height" in maps else 0.0
