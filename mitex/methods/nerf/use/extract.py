"""A mesh of what is solid in a shell, with its colours: the texture leaves the renderer."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mitex.asset import Asset
from mitex.errors import ConfigError, MeshError
from mitex.geometry.normal_maps import encode
from mitex.geometry.vectors import orthonormal
from mitex.mesh import Mesh, Similarity
from mitex.methods.nerf.base.isosurface import isosurface
from mitex.methods.nerf.field.lighting import COEFFICIENTS
from mitex.methods.nerf.field.occupancy import sample_grid
from mitex.methods.nerf.field.shell import Shell, appearance
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.progress import announce
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload

CELLS = 3  # of the grid along a side of a cell of the occupancy grid
FLOOR = -4.0  # logarithm of a density beside the level's, at least
CHUNK = 1 << 17  # vertices that are coloured at a time


def extract_mesh(shell: Shell, similarity: Similarity, name: str, cells: int | None = None) -> Asset:
    """The surface where the density takes half of the light within a cell, with albedo and normals.

    Args:
        shell: a texture around a mesh.
        similarity: the mesh's space -> scene cube.
        name: of the asset.
        cells: of the grid along a side of the scene cube, a multiple of the occupancy grid's; None for three
            times as many.

    Returns:
        An asset in the mesh's space; colours are those under an even light, without gloss.

    Raises:
        ConfigError: `cells` is out of range.
        MeshError: nothing is so dense.
    """
    announce("cutting out what is solid")
    mesh = solid_surface(shell.density, np.array(shell.mask).astype(bool), name, cells)
    albedo, normals = _albedo_and_normals(shell, mesh)
    placed = mesh.with_vertices(similarity.inverse(mesh.vertices))
    tangents = orthonormal(np.broadcast_to(np.array([1.0, 0.0, 0.0]), normals.shape), mesh.normals)
    detail = encode(normals, tangents, np.cross(mesh.normals, tangents), mesh.normals)
    return Asset(placed, {"albedo": albedo, "normal": detail}, tangents.astype(np.float32), name=name)


def solid_surface(
    density: Callable[[np.ndarray], np.ndarray], occupied: np.ndarray, name: str, cells: int | None = None
) -> Mesh:
    """The surface where the density takes half of the light within a cell, in the scene cube.

    Args:
        density: of points (N, 3), (N,) [1 / scene units].
        occupied: (G, G, G) bool, cells outside of which it is 0.
        name, cells: as of `extract_mesh`, which says what is raised.
    """
    side = len(occupied)
    count = CELLS * side if cells is None else cells
    if count % side or not side <= count <= 8 * side:
        raise ConfigError(f"a grid of {count} cells", f"use a multiple of {side}, up to {8 * side}")
    level = math.log(2) * count / 2
    values = sample_grid(density, occupied, count)
    if not (values > level).any():
        raise MeshError(f"nothing in '{name}' is solid", "raise the density, or train it for longer")
    # In logarithms, so that the surface lies well between samples whose densities differ by orders.
    values = np.maximum(np.log(np.maximum(values, 1e-6) / level), FLOOR)
    cell = 2 / count
    return isosurface(values, 0.0, low=np.full(3, 0.5 * cell - 1), cell=cell, name=name)


def _albedo_and_normals(shell: Shell, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Colours (V, 3) under an even light of the learned one's strength, and fine normals (V, 3)."""
    even = np.zeros(COEFFICIENTS, np.float32)
    even[0] = np.array(shell.light).reshape(COEFFICIENTS, -1)[0].mean()
    light = upload(mi.TensorXf, even)
    colours, normals = np.full((len(mesh.vertices), 3), 0.5, np.float32), mesh.normals.copy()
    for start in range(0, len(mesh.vertices), CHUNK):
        part = slice(start, start + CHUNK)
        index, coords = shell.locate(channels(mi.Point3f, mesh.vertices[part]))
        vertex = np.array(index) + start
        if len(vertex):
            view = channels(mi.Vector3f, -mesh.normals[vertex])
            _, colour, normal = appearance(shell.latents, shell.decoder, light, coords, view)
            colours[vertex], normals[vertex] = rows(colour), rows(normal)
    return colours.clip(0, 1), normals
