"""`AppliedField`: a field as a picture or as a mesh, in the world that its cube lies in."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from mitex.asset import Asset
from mitex.export import Format, prepare_export
from mitex.mesh import Similarity
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.methods.nerf.use.extract import CHUNK, solid_surface
from mitex.runtime.jit import dr, mi
from mitex.textures.march import RadianceField


class SolidField(RadianceField, Protocol):
    """A field whose density can be asked for."""

    def density_at(self, points: np.ndarray) -> np.ndarray:
        """Density [1 / scene units] of points (N, 3) of the scene cube, (N,)."""
        ...


Field = TypeVar("Field", bound=SolidField)


class AppliedField(Generic[Field]):
    """A `RadianceField` in the scene cube, and what leaves it.

    Args:
        field: of an object, as it was learned, or around a mesh.
        similarity: the object's world -> scene cube.
        name: of the object.
        strength: factor of the density.
    """

    def __init__(self, field: Field, similarity: Similarity, name: str, strength: float = 1.0) -> None:
        self.field, self.similarity, self.name, self.strength = field, similarity, name, strength
        self.mask, self.step = field.mask, field.step

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        """As of `RadianceField`."""
        index, density, colour = self.field.evaluate(points, view)
        factor = dr.opaque(mi.Float, self.strength)  # a literal would ask for another kernel
        return index, density * factor if dr.width(index) else density, colour

    def density(self, points: np.ndarray) -> np.ndarray:
        """Density [1 / scene units] of points (N, 3) of the scene cube, (N,)."""
        return self.field.density_at(points) * np.float32(self.strength)

    @property
    def maps(self) -> Mapping[str, np.ndarray]:
        """Colours of the surface's vertices, as `export` writes them."""
        return self.surface.maps

    def export(self, path: str | os.PathLike[str], maps_format: Format = "png") -> Path:
        """Writes what is solid as a coloured mesh, as of `Asset.export`.

        Raises:
            OutputError: unknown suffix or unwritable place.
            MeshError: nothing is solid.
        """
        prepare_export(path, maps_format=maps_format)
        return self.surface.export(path, maps_format)

    def render(self, path: str | os.PathLike[str], *, exposure: float = 0.0, **options: Any) -> Path:
        """Path-traces the object in the studio, y upwards: PNG or JPEG; options as of `shell_still`.

        Raises:
            OutputError: unknown suffix or unwritable place.
            ConfigError: an option out of range.
        """
        from mitex.render.shell import render_shell

        return render_shell(self, self.similarity, self.outline, path, exposure=exposure, **options)

    @cached_property
    def surface(self) -> Asset:
        """A mesh of what is solid in the object's world, see `solid_surface`; its colours are those that are
        seen along the normals, grey where there is no matter."""
        mesh = solid_surface(self.density, np.array(self.mask).astype(bool), self.name)
        colours = np.full((len(mesh.vertices), 3), 0.5, np.float32)
        for start in range(0, len(colours), CHUNK):
            part = slice(start, start + CHUNK)
            view = channels(mi.Vector3f, -mesh.normals[part])
            index, _, colour = self.field.evaluate(channels(mi.Point3f, mesh.vertices[part]), view)
            colours[start + np.array(index)] = rows(colour)
        placed = mesh.with_vertices(self.similarity.inverse(mesh.vertices))
        return Asset(placed, {"albedo": colours.clip(0, 1)}, name=self.name)

    @property
    def outline(self) -> np.ndarray:
        """(N, 3) middles of the occupied cells, in the object's world."""
        cells = np.argwhere(np.array(self.mask))
        return self.similarity.inverse((cells + 0.5) * (2 / self.mask.shape[0]) - 1)
