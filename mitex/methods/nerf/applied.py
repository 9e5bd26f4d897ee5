"""`AppliedTexture`: a radiance-field texture on a mesh of the user's (section 3.2.4)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from mitex.atlas import laid_out
from mitex.errors import ConfigError, MeshError
from mitex.export import SUFFIXES
from mitex.images import write_image
from mitex.integrators.march import DIAGONAL
from mitex.mesh import Mesh, Similarity
from mitex.methods.nerf.maps import LatentMaps, MappedLatents, uv_frames
from mitex.methods.nerf.occupancy import Occupancy
from mitex.methods.nerf.projection import Projection
from mitex.methods.nerf.radiance import look_step
from mitex.methods.nerf.shell import Shell, shell_cells
from mitex.paths import prepare_output
from mitex.runtime import load_mitsuba

if TYPE_CHECKING:
    from mitex.asset import Asset
    from mitex.methods.nerf.texture import NerfTexture

mi: Any = load_mitsuba(needs_llvm=False)

PICTURES = (".png", ".jpg", ".jpeg")
EXTENT = 1 / 1.2  # of the mesh in the scene cube
NEIGHBOURS = 5  # vertices that make the coarse normal of a target
LOOKS = 6  # at each cell, to find which ones are occupied
FINEST = 2048  # steps across the scene cube, at most
UNWRAPPED = 1024  # texels that the distances of charts are made for


class AppliedTexture(Shell):
    """A texture in the shell around a mesh, in the scene cube.

    Attributes:
        mesh: the target, as it was given but for its UVs.
        similarity: the mesh's space -> scene cube.

    Args:
        texture, maps, scale, density, lift, light: as of `NerfTexture.apply`.
    """

    def __init__(
        self,
        texture: NerfTexture,
        mesh: Mesh,
        maps: LatentMaps,
        *,
        scale: float,
        density: float,
        lift: float,
        light: Any,
    ) -> None:
        if not 0.05 <= scale <= 20 or not 0 < density <= 1000 or not 0 <= lift <= 1:
            raise ConfigError(
                f"a texture of {scale} times the size, {density} times the density and lifted by {lift}",
                "use sizes from 0.05 to 20, densities up to 1000 and lifts from 0 to 1",
            )
        self.mesh, self._maps = laid_out(mesh, UNWRAPPED), maps
        placed, self.similarity = centred(self.mesh)
        # One unit of the UVs shows so many textures that their elements have the size that is wanted.
        uv = np.asarray(placed.uv) * (stretch(placed) / (maps.size[1] * maps.gap * scale))
        thickness = texture.model.base.thickness * scale
        raised = lift * scale * max(-texture.ground, 0.0)
        projection = Projection(placed, neighbours=NEIGHBOURS, pull=None, reach=thickness + raised)
        cells = texture.model.config.occupancy
        step = max(scale * look_step(texture.model.config), DIAGONAL / FINEST)
        possible = shell_cells(projection, thickness, np.ones((cells,) * 3, bool), raised)
        occupancy = Occupancy(cells, possible)
        latents = MappedLatents(maps, uv, uv_frames(placed))
        super().__init__(
            projection,
            latents,
            texture.decoder,
            light,
            thickness,
            mask=occupancy.mask,
            step=step,
            scale=scale,
            strength=density,
            lift=raised,
        )
        drawn = torch.Generator().manual_seed(0)
        for _ in range(LOOKS):
            occupancy.refresh(self.density, drawn)
        self.mask = occupancy.mask

    @property
    def maps(self) -> Mapping[str, np.ndarray]:
        """The latent features that the shell wears, (H, W, C)."""
        return {"features": self._maps.features}

    def export(self, path: str | os.PathLike[str]) -> Path:
        """Writes what is solid as a coloured mesh, as of `Asset.export`.

        Raises:
            OutputError: unknown suffix or unwritable place.
        """
        return self.extract().export(prepare_output(path, SUFFIXES))

    def render(self, path: str | os.PathLike[str], *, exposure: float = 0.0, **options: Any) -> Path:
        """Path-traces the texture in the studio: PNG or JPEG; options as of `shell_still`.

        Raises:
            OutputError: unknown suffix or unwritable place.
        """
        from mitex.render import tone
        from mitex.render.shell import shell_still

        target = prepare_output(path, PICTURES)
        return write_image(
            target, tone(shell_still(self, self.similarity, self.outline, **options), exposure)
        )

    def extract(self, cells: int | None = None) -> Asset:
        """A coloured mesh of what is solid; see `extract.extracted`."""
        from mitex.methods.nerf.extract import extracted

        return extracted(self, cells)

    @property
    def outline(self) -> np.ndarray:
        """(2 V, 3) points of the mesh's space that the shell lies between."""
        ends = self.similarity.scale * np.array([self.lift - self.thickness, self.lift + self.thickness])
        return np.concatenate([self.mesh.vertices + end * self.mesh.normals for end in ends])


def centred(mesh: Mesh) -> tuple[Mesh, Similarity]:
    """The mesh in the scene cube, with a margin for the shell, and how it got there."""
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    half = float((high - low).max()) / 2
    if half == 0:
        raise MeshError(f"all vertices of {mesh.name} are at one point", "check how it was exported")
    similarity = Similarity((low + high) / 2, half / EXTENT)
    return mesh.with_vertices(similarity.apply(mesh.vertices)), similarity


def stretch(mesh: Mesh) -> float:
    """How long a unit of the UVs is on the mesh: mean edge here by mean edge there."""

    def edges(corners: np.ndarray) -> float:
        return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())

    flat = edges(np.asarray(mesh.uv))
    if flat == 0:
        raise MeshError(f"the UVs of {mesh.name} have no area", "unwrap it again, or leave them out")
    return edges(mesh.vertices[mesh.faces]) / flat
