"""`AppliedTexture`: a radiance-field texture on a mesh of the user's (section 3.2.4)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.asset import Asset
from mitex.errors import ConfigError
from mitex.export import Format, prepare_export
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh
from mitex.methods.checks import in_range
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field.decoder import Decoder
from mitex.methods.nerf.field.lighting import COEFFICIENTS
from mitex.methods.nerf.field.occupancy import Occupancy
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.field.rendering import render_step
from mitex.methods.nerf.field.shell import Shell, ShellCoords, shell_cells, shell_reach
from mitex.methods.nerf.field.tensors import channels
from mitex.methods.nerf.ranges import DENSITIES, LIFTS
from mitex.methods.nerf.synthesis.maps import LatentMaps, MappedLatents
from mitex.methods.nerf.use.extract import extract_mesh
from mitex.methods.nerf.use.placement import in_scene_cube
from mitex.progress import announce
from mitex.ranges import SCALES
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.march import DIAGONAL

NEIGHBOURS = 5  # vertices that make the coarse normal of a target
OCCUPANCY_SAMPLES = 6  # of the density in each cell, to find which ones are occupied
FINEST = 2048  # steps across the scene cube, at most


def check_ranges(scale: float, density: float, lift: float) -> None:
    """Raises a ConfigError if one of these numbers of `NerfTexture.apply` is out of range."""
    in_range("`scale`", scale, *SCALES)
    in_range("`density`", density, *DENSITIES)
    in_range("`lift`", lift, *LIFTS)


def checked_light(light: np.ndarray) -> mi.TensorXf:
    """Spherical harmonics of a user's light; raises a ConfigError if they are none."""
    coefficients = np.asarray(light, np.float32)
    if coefficients.shape not in ((COEFFICIENTS,), (COEFFICIENTS, 3)) or not np.isfinite(coefficients).all():
        raise ConfigError(
            f"a light of shape {coefficients.shape}",
            f"give finite spherical harmonics, ({COEFFICIENTS},) or ({COEFFICIENTS}, 3)",
        )
    return upload(mi.TensorXf, coefficients)


def joined_on_surface(quilting: str | None, guide: np.ndarray | None) -> bool:
    """Whether patches are joined on the mesh; raises a ConfigError if `quilting` is no place."""
    if quilting not in (None, "surface", "plane"):
        raise ConfigError(f"unknown quilting {quilting!r}", 'use "surface" or "plane"')
    return quilting == "surface" or (quilting is None and guide is None)


class AppliedTexture(Shell):
    """A texture in the shell around a mesh, in the scene cube.

    Attributes:
        mesh: the target.
        similarity: the mesh's space -> scene cube.

    Args:
        mesh: the target, with UVs.
        maps, scale, density, lift: as of `NerfTexture.apply`, in the ranges of `check_ranges`.
        decoder: the texture's networks, packed.
        light: spherical harmonics, see `lighting`.
        config: settings of the texture.
        thickness: h of the captured shell [scene units].
        ground: how far the deepest parts of the captured surface are from the base shape [scene units].
    """

    def __init__(
        self,
        mesh: Mesh,
        maps: LatentMaps,
        decoder: Decoder,
        light: mi.TensorXf,
        config: NerfConfig,
        *,
        thickness: float,
        ground: float,
        scale: float,
        density: float,
        lift: float,
    ) -> None:
        self.mesh, self._maps = mesh, maps
        placed, self.similarity = in_scene_cube(self.mesh)
        raised = lift * scale * max(-ground, 0.0)
        thickness = thickness * scale
        cells = config.occupancy
        reach = shell_reach(thickness, cells, raised)
        projection = Projection(placed, neighbours=NEIGHBOURS, repulsion=None, reach=reach)
        possible = shell_cells(projection, thickness, np.ones((cells,) * 3, bool), raised)
        occupancy = Occupancy(cells, possible)
        super().__init__(
            projection,
            MappedLatents.over(placed, maps, scale),
            decoder,
            light,
            thickness,
            mask=occupancy.mask,
            step=max(scale * render_step(config), DIAGONAL / FINEST),
            scale=scale,
            strength=density,
            lift=raised,
        )
        generator = torch.Generator().manual_seed(0)
        for sample in range(OCCUPANCY_SAMPLES):
            announce("looking for what is dense", sample, OCCUPANCY_SAMPLES)
            occupancy.refresh(self.density, generator)
        self.mask = occupancy.mask

    @property
    def maps(self) -> Mapping[str, np.ndarray]:
        """The latent features on the mesh's UVs, (H, W, C)."""
        return {"features": self._maps.features}

    def features_at(self, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """f at points of the mesh.

        Args:
            face: (P,) the faces that they lie on.
            barycentric: (P, 3) where on them.

        Returns:
            (P, 16) float32.
        """
        at = channels(mi.Point2f, barycentric[:, 1:].astype(np.float32))
        corners = self.projection.mesh.vertices[self.projection.mesh.faces[face]]
        foot = channels(mi.Point3f, interpolate(barycentric, corners).astype(np.float32))
        faces = upload(mi.UInt32, np.ascontiguousarray(face, np.uint32))
        coords = ShellCoords(foot, mi.Float(0), faces, at, mi.Vector3f(0))
        values = self.latents.features(coords)
        dr.eval(values)  # at once, not in a kernel for each
        return np.stack([np.array(value) for value in values], axis=1)

    def export(self, path: str | os.PathLike[str], maps_format: Format = "png") -> Path:
        """Writes what is solid as a coloured mesh, as of `Asset.export`.

        Raises:
            OutputError: unknown suffix or unwritable place.
        """
        prepare_export(path, maps_format=maps_format)
        return self.extract().export(path, maps_format)

    def render(self, path: str | os.PathLike[str], *, exposure: float = 0.0, **options: Any) -> Path:
        """Path-traces the texture in the studio: PNG or JPEG; options as of `shell_still`.

        Raises:
            OutputError: unknown suffix or unwritable place.
            ConfigError: an option out of range.
        """
        from mitex.render.shell import render_shell

        return render_shell(self, self.similarity, self.outline, path, exposure=exposure, **options)

    def extract(self, cells: int | None = None) -> Asset:
        """A coloured mesh of what is solid, in the mesh's space; see `extract_mesh`."""
        return extract_mesh(self, self.similarity, self.mesh.name, cells)

    @property
    def outline(self) -> np.ndarray:
        """(2 V, 3) points of the mesh's space that the shell lies between."""
        ends = self.similarity.scale * np.array([self.lift - self.thickness, self.lift + self.thickness])
        return np.concatenate([self.mesh.vertices + end * self.mesh.normals for end in ends])
