"""A mesh of what is solid in a shell, with its colours: the texture leaves the renderer."""

from __future__ import annotations

import math

import numpy as np

from mitex.asset import Asset
from mitex.errors import ConfigError, MeshError
from mitex.frames import encode, orthonormal
from mitex.mesh import Mesh
from mitex.methods.nerf.applied import AppliedTexture
from mitex.methods.nerf.isosurface import isosurface
from mitex.methods.nerf.lighting import COEFFICIENTS
from mitex.methods.nerf.occupancy import gridded
from mitex.methods.nerf.shell import appearance
from mitex.methods.nerf.tensors import channels, rows
from mitex.runtime.jit import mi

CELLS = 3  # of the grid along a side of a cell of the occupancy grid
FLOOR = -4.0  # logarithm of densities below [of the level]
CHUNK = 1 << 17


def extracted(applied: AppliedTexture, cells: int | None = None) -> Asset:
    """The surface where the density takes half of the light within a cell, with albedo and normals.

    Args:
        applied: a texture on a mesh.
        cells: of the grid along a side of the scene cube, a multiple of the occupancy grid's; None for three
            times as many.

    Returns:
        An asset in the space of the textured mesh; colours are those under an even light, without gloss.

    Raises:
        MeshError: nothing is so dense.
    """
    side = applied.mask.shape[0]
    count = CELLS * side if cells is None else cells
    if count % side or not side <= count <= 8 * side:
        raise ConfigError(f"a grid of {count} cells", f"use a multiple of {side}, up to {8 * side}")
    level = math.log(2) * count / 2
    density = gridded(applied.density, np.array(applied.mask).astype(bool), count)
    if not (density > level).any():
        raise MeshError("nothing in the shell is solid", "raise the density, or train the texture for longer")
    # In logarithms, so that the surface lies well between samples whose densities differ by orders.
    values = np.maximum(np.log(np.maximum(density, 1e-6) / level), FLOOR)
    cell = 2 / count
    mesh = isosurface(values, 0.0, low=np.full(3, 0.5 * cell - 1), cell=cell, name=applied.mesh.name)
    albedo, normals = _looks(applied, mesh)
    placed = mesh.with_vertices(mesh.vertices * applied.similarity.scale + applied.similarity.center)
    tangents = orthonormal(np.broadcast_to(np.array([1.0, 0.0, 0.0]), normals.shape), mesh.normals)
    detail = encode(normals, tangents, np.cross(mesh.normals, tangents), mesh.normals)
    return Asset(placed, {"albedo": albedo, "normal": detail}, tangents.astype(np.float32), name=mesh.name)


def _looks(applied: AppliedTexture, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Colours (V, 3) under an even light of the learned one's strength, and fine normals (V, 3)."""
    even = np.zeros(COEFFICIENTS, np.float32)
    even[0] = np.array(applied.light).reshape(COEFFICIENTS, -1)[0].mean()
    light = mi.TensorXf(even)
    colours, normals = np.full((len(mesh.vertices), 3), 0.5, np.float32), mesh.normals.copy()
    for start in range(0, len(mesh.vertices), CHUNK):
        part = slice(start, start + CHUNK)
        index, located = applied.locate(channels(mi.Point3f, mesh.vertices[part]))
        where = np.array(index) + start
        if len(where):
            view = channels(mi.Vector3f, -mesh.normals[where])
            _, colour, normal = appearance(applied.latents, applied.decoder, light, located, view)
            colours[where], normals[where] = rows(colour), rows(normal)
    return colours.clip(0, 1), normals
