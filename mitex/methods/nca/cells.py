"""The mesh that an automaton runs on, beside the mesh that its texture is for.

A cell sits at each vertex, and the size of a pattern follows their density. So a mesh is subdivided, or
meshed anew, for the automaton alone; points of the base mesh are looked up on it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh, remesh, subdivide_loop, subdivide_midpoint
from mitex.mesh.nearest import nearest_points
from mitex.mesh.subdivide import child_points
from mitex.methods.checks import in_range
from mitex.methods.layout import RESOLUTION, layout_side, with_layout
from mitex.ranges import EVEN_VERTICES, SCALES

ENOUGH_VERTICES = 8_000  # "auto" subdivides until a mesh has them: the training has 10,242
MOST_LEVELS = 6
MOST_VERTICES = 4_000_000  # a gigabyte of states


@dataclass(frozen=True, eq=False)
class Cells:
    """An automaton's mesh.

    Attributes:
        mesh: with a cell at each vertex.
        levels: rounds of midpoint subdivision that made it of the base mesh; None if it was meshed anew.
        base: the mesh that the texture is for.
    """

    mesh: Mesh
    levels: int | None
    base: Mesh

    @staticmethod
    def of(mesh: Mesh, subdivide: int | str = "auto", scale: float = 1.0) -> Cells:
        """The cells of a mesh; arguments and errors as of `NcaTexture.apply`."""
        levels = check(mesh, subdivide, scale)
        fine = subdivide_midpoint(mesh, levels)
        if scale == 1.0:
            return Cells(fine, levels, mesh)
        return Cells(remesh(fine, max(int(len(fine.vertices) / scale**2), EVEN_VERTICES[0])), None, mesh)

    @staticmethod
    def dense(mesh: Mesh, subdivide: int | str = "auto", scale: float = 1.0) -> Cells:
        """Cells at the vertices of a finer, rounder mesh, which is then the one that the texture is for."""
        levels = check(mesh, subdivide, scale)
        fine = subdivide_loop(mesh, levels)
        if scale != 1.0:
            fine = remesh(fine, max(int(len(fine.vertices) / scale**2), EVEN_VERTICES[0]))
        return Cells(fine, 0, fine)

    def locate(self, face: np.ndarray, barycentric: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Faces (P,) and barycentrics (P, 3) on the automaton's mesh of points of the base mesh."""
        if self.levels is not None:
            return child_points(face, barycentric, self.levels)
        corners = self.base.vertices[self.base.faces[face]]
        return nearest_points(self.mesh, interpolate(barycentric, corners))


def scale_of_width(mesh: Mesh, width: float, density: float, subdivide: int | str = "auto") -> float:
    """The `scale` at which an exemplar is as wide as on a surface texture.

    Args:
        mesh: any mesh.
        width: of the exemplar [sides of the square of the layout that surface textures have].
        density: cells along the exemplar's width.
        subdivide: as of `NcaTexture.apply`.

    Raises:
        ConfigError: an option or the scale is out of range, or the mesh has no area.
    """
    count = len(mesh.vertices) * 4 ** check(mesh, subdivide, 1.0)
    edge = math.sqrt(2 * float(mesh.face_areas.sum()) / (math.sqrt(3) * count))  # of even triangles
    scale = width * layout_side(with_layout(mesh, RESOLUTION)) / (density * edge)
    low, high = SCALES
    if not low <= scale <= high:
        problem = f"an exemplar_width of {width:g} is a scale of {scale:.3g} on '{mesh.name}'"
        raise ConfigError(problem, f"use {low * width / scale:.2g} to {high * width / scale:.2g}")
    return scale


def check(mesh: Mesh, subdivide: int | str, scale: float) -> int:
    """The number of subdivisions, once it is sure that they are possible.

    Raises:
        ConfigError: an option is out of range, or there would be too many cells.
    """
    if subdivide == "auto":
        levels = 0
        while len(mesh.vertices) * 4**levels < ENOUGH_VERTICES and levels < MOST_LEVELS:
            levels += 1
    else:
        levels = subdivide if isinstance(subdivide, int) else -1
    if not 0 <= levels <= MOST_LEVELS:
        raise ConfigError(f"subdivide = {subdivide}", f"use 'auto' or 0 to {MOST_LEVELS}")
    in_range("`scale`", scale, *SCALES)
    if len(mesh.vertices) * 4**levels * max(1 / scale**2, 1) > MOST_VERTICES:
        raise ConfigError(f"a mesh of more than {MOST_VERTICES:,} vertices", "subdivide less")
    return levels
