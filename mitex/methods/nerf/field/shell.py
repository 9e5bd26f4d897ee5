"""A radiance-field texture in the shell around a mesh: density and colour of points (section 3.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy import ndimage

from mitex.errors import ConfigError
from mitex.methods.nerf.field.decoder import HIGHEST, Decoder
from mitex.methods.nerf.field.encoding import Encoding
from mitex.methods.nerf.field.lighting import reflectances, shade, to_display
from mitex.methods.nerf.field.occupancy import sample_grid
from mitex.methods.nerf.field.projection import Projection, Projections
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.phong import Phong


@dataclass
class ShellCoords:
    """Coordinates of N points in the shell, as Dr.Jit arrays.

    Attributes:
        foot: `mi.Point3f` foot points on the mesh [scene units].
        distance: signed, `mi.Float`, in the units that the networks were trained with.
        face: `mi.UInt32`.
        barycentric: `mi.Point2f`, weights of the face's corners 1 and 2.
        normal: `mi.Vector3f`, the coarse normal n_c.
    """

    foot: mi.Point3f
    distance: mi.Float
    face: mi.UInt32
    barycentric: mi.Point2f
    normal: mi.Vector3f

    @staticmethod
    def of(projections: Projections, scale: float = 1.0) -> ShellCoords:
        """Of projections that all hit; `scale` divides the distances."""
        return ShellCoords(
            channels(mi.Point3f, projections.point),
            upload(mi.Float, projections.distance / np.float32(scale)),
            upload(mi.UInt32, projections.face.astype(np.uint32)),
            channels(mi.Point2f, projections.barycentric),
            channels(mi.Vector3f, projections.normal),
        )

    def subset(self, index: mi.UInt32) -> ShellCoords:
        """The points at `index`, detached."""
        return ShellCoords(*(dr.gather(type(v), dr.detach(v), index) for v in vars(self).values()))


class Latents(Protocol):
    """Where features come from: hash grids on the captured shape, or synthesized maps on another one."""

    def __call__(self, coords: ShellCoords) -> tuple[list[mi.Float], list[mi.Float]]:
        """f (16 arrays) and f-hat (8)."""
        ...

    def features(self, coords: ShellCoords) -> list[mi.Float]:
        """f alone, which the density needs."""
        ...

    def frame(self, coords: ShellCoords) -> tuple[mi.Vector3f, mi.Vector3f, mi.Vector3f]:
        """Tangent, bitangent and normal that theta and phi refer to, `mi.Vector3f`s."""
        ...

    @property
    def parameters(self) -> dict[str, dr.ArrayBase]:
        """Arrays that features are looked up in, by name."""
        ...


class CapturedLatents:
    """Features of the captured base shape.

    Args:
        encoding: the hash grids.
        tables: of f and f-hat, flat `mi.Float`.
        frames: (F, 3, 3) rows t, b, n of its faces.
    """

    def __init__(self, encoding: Encoding, tables: list[mi.Float], frames: np.ndarray) -> None:
        self.encoding, self.tables = encoding, tables
        self.frames = upload(mi.Float, np.ascontiguousarray(frames, np.float32).ravel())

    def __call__(self, coords: ShellCoords) -> tuple[list[mi.Float], list[mi.Float]]:
        return self.features(coords), self.encoding(1, coords.foot, self.tables[1])

    def features(self, coords: ShellCoords) -> list[mi.Float]:
        return self.encoding(0, coords.foot, self.tables[0])

    def frame(self, coords: ShellCoords) -> tuple[mi.Vector3f, mi.Vector3f, mi.Vector3f]:
        rows = [dr.gather(mi.Vector3f, self.frames, coords.face * 3 + k) for k in range(3)]
        return rows[0], rows[1], rows[2]

    @property
    def parameters(self) -> dict[str, dr.ArrayBase]:
        return dict(zip(("tables.f", "tables.phase"), self.tables, strict=True))


def appearance(
    latents: Latents,
    decoder: Decoder,
    light: mi.TensorXf,
    coords: ShellCoords,
    view: mi.Vector3f,
    detach: bool = False,
) -> tuple[mi.Float, mi.Color3f, mi.Vector3f]:
    """Density, colour and fine normal of points in the shell (section 3.1.5).

    Args:
        latents, decoder: the texture.
        light: spherical harmonics, see `lighting`.
        coords: N points.
        view: `mi.Vector3f`, the unit directions in which the rays travel.
        detach: the colour has no derivative to the normal.

    Returns:
        Density [1 / scene units of the texture], colour `mi.Color3f` in display values, and unit normal.
    """
    f, phase = latents(coords)
    reflection = decoder(f, phase, coords.distance)
    normal = reflection.normal(*latents.frame(coords))
    facing = dr.detach(normal) if detach else normal
    specular = reflection.specular_at(dr.clip(-dr.dot(facing, view), 0, 1))
    shaded = shade(facing, view, reflection.diffuse, specular, reflection.glossiness, light)
    return reflection.density, to_display(shaded), normal


class Shell:
    """A texture around a mesh, as a renderer sees it.

    Args:
        projection: onto the mesh.
        latents, decoder: the texture; a packed decoder is fast.
        light: spherical harmonics.
        thickness: h, half of the shell's [scene units].
        mask: (G, G, G) `mi.TensorXu8`, the occupied cells of the scene cube.
        step: of rays through it [scene units].
        scale: size of the texture beside that of the capture.
        strength: factor of the density.
        lift: of the shell's middle above the mesh [scene units].
    """

    def __init__(
        self,
        projection: Projection,
        latents: Latents,
        decoder: Decoder,
        light: mi.TensorXf,
        thickness: float,
        mask: mi.TensorXu8,
        step: float,
        scale: float = 1.0,
        strength: float = 1.0,
        lift: float = 0.0,
    ) -> None:
        self.projection, self.latents, self.decoder = projection, latents, decoder
        self.light, self.thickness, self.scale = light, thickness, scale
        self.mask, self.step, self.strength, self.lift = mask, step, strength, lift
        self._shapes = {name: dr.shape(value) for name, value in self.parameters().items()}

    def parameters(self) -> dict[str, dr.ArrayBase]:
        """Features, matrices of the networks and light, by name; images are differentiable in them."""
        weights = {f"weights.{name}": value for name, value in self.decoder.parameters.items()}
        return {**self.latents.parameters, **weights, "light": self.light}

    def parameters_changed(self) -> None:
        """Takes over new values of the parameters; cells of the mask that were empty stay empty.

        Raises:
            ConfigError: a parameter has another shape than before.
        """
        for name, value in self.parameters().items():
            if dr.shape(value) != self._shapes[name]:
                raise ConfigError(
                    f"shell_field: '{name}' has shape {dr.shape(value)}", f"give {self._shapes[name]}"
                )
        self.decoder.pack()

    @property
    def _factor(self) -> mi.Float:
        """Of the density; opaque, or each would ask for a kernel of its own."""
        return dr.opaque(mi.Float, self.strength / self.scale)

    def locate(self, points: mi.Point3f) -> tuple[mi.UInt32, ShellCoords]:
        """Which of the points, `mi.Point3f`, are in the shell, as ascending `mi.UInt32`, and where."""
        index, projections = within(self.projection(rows(points)), self.thickness, self.lift)
        return upload(mi.UInt32, index.astype(np.uint32)), ShellCoords.of(projections, self.scale)

    def density(self, points: np.ndarray) -> np.ndarray:
        """Density [1 / scene units] of points (N, 3), (N,); 0 outside of the shell."""
        index, density = self.extinction(channels(mi.Point3f, points))
        result = np.zeros(len(points), np.float32)
        result[np.array(index)] = np.array(density)
        return result

    def extinction(self, points: mi.Point3f) -> tuple[mi.UInt32, mi.Float]:
        """Ascending indices of those of N points that are in the shell, their density [1 / scene units]."""
        index, coords = self.locate(points)
        if not dr.width(index):
            return mi.UInt32(), mi.Float()
        exponent = self.decoder.exponent(self.latents.features(coords), coords.distance)
        return index, dr.exp(dr.minimum(exponent, HIGHEST)) * self._factor

    def reflection(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, Phong]:
        """Ascending indices of those of N points that are in the shell, and their reflection.

        Args:
            points, view: as of `evaluate`.
        """
        index, coords = self.locate(points)
        f, phase = self.latents(coords)
        values = self.decoder(f, phase, coords.distance)
        normal = values.normal(*self.latents.frame(coords))
        along = dr.gather(mi.Vector3f, view, index)
        specular = values.specular_at(dr.clip(-dr.dot(normal, along), 0, 1))
        return index, Phong(normal, *reflectances(values.diffuse, specular, self.light), values.glossiness)

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        """Density and colour of those of N points that are in the shell.

        Args:
            points, view: `mi.Point3f` and the unit directions of the rays, `mi.Vector3f`.

        Returns:
            Ascending indices (M,) `mi.UInt32`, density (M,) [1 / scene units], colour (M,) in display values.
        """
        index, coords = self.locate(points)
        if not dr.width(index):
            return mi.UInt32(), mi.Float(), mi.Color3f()
        along = dr.gather(mi.Vector3f, view, index)
        density, colour, _ = appearance(self.latents, self.decoder, self.light, coords, along)
        return index, density * self._factor, colour


def within(projections: Projections, thickness: float, lift: float = 0.0) -> tuple[np.ndarray, Projections]:
    """Indices and projections of the points in the shell, |s| < h; s counts from the lift on."""
    distance = projections.distance - np.float32(lift)
    index = np.flatnonzero(np.abs(distance) < thickness)
    subset = Projections(*(values[index] for values in vars(projections).values()))
    return index, replace(subset, distance=distance[index])


def shell_reach(thickness: float, side: int, lift: float = 0.0) -> float:
    """How far from the mesh `shell_cells` looks for a shell's cells, `side` along the cube [scene units].

    A shell thinner than a cell may lie between the cells' centres: half of their diagonal is then the reach.
    """
    return max(thickness, math.sqrt(3) / side) + lift


def shell_cells(
    projection: Projection, thickness: float, possible: np.ndarray, lift: float = 0.0
) -> np.ndarray:
    """Cells of the scene cube that the shell may touch: those with a centre within its reach, and neighbours.

    Args:
        projection: onto the mesh; with a reach of its own, that is `shell_reach` at least.
        thickness: h [scene units].
        possible: (G, G, G) bool, the cells that are looked at.
        lift: of the shell's middle above the mesh [scene units].
    """
    reach = shell_reach(thickness, len(possible))

    def in_shell(points: np.ndarray) -> np.ndarray:
        return np.abs(projection(points).distance - lift) < reach

    return ndimage.binary_dilation(sample_grid(in_shell, possible, len(possible)) > 0)
