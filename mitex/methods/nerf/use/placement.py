"""Where a user's mesh lies in the scene cube, and how large a texture is on it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from mitex.atlas import laid_out
from mitex.errors import ConfigError, MeshError
from mitex.geometry.triangles import interpolate
from mitex.images import bilinear
from mitex.mesh import Mesh, Similarity
from mitex.methods.layout import layout_side
from mitex.quilting.guide import checked_picture
from mitex.quilting.texels import FaceTexels

EXTENT = 1 / 1.2  # largest half extent of the mesh in the scene cube
UNWRAP_SIZE = 1024  # side of the map that charts are packed for [texels]
COARSEST = 4.0  # side of a texel of a map on a mesh, at most [texels of patches]
SMALLEST = 16  # side of such a map [texels]
LARGEST = 8192  # side of a texture under a guide, at most [texels]


def in_scene_cube(mesh: Mesh) -> tuple[Mesh, Similarity]:
    """The mesh in the scene cube, with a margin for the shell; and the mesh's space -> scene cube.

    Raises:
        MeshError: all vertices are at one point.
    """
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    half = float((high - low).max()) / 2
    if half == 0:
        raise MeshError(f"all vertices of {mesh.name} are at one point", "check how it was exported")
    similarity = Similarity((low + high) / 2, half / EXTENT)
    return mesh.with_vertices(similarity.apply(mesh.vertices)), similarity


def uv_unit_length(mesh: Mesh) -> float:
    """Length of a unit of the UVs on the mesh [mesh units]: mean edge on the mesh by mean edge in the UVs.

    Raises:
        MeshError: the UVs have no area.
    """

    def mean_edge(corners: np.ndarray) -> float:
        return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())

    flat = mean_edge(np.asarray(mesh.uv))
    if flat == 0:
        raise MeshError(f"the UVs of {mesh.name} have no area", "unwrap it again, or leave them out")
    return mean_edge(mesh.vertices[mesh.faces]) / flat


def guided_side(mesh: Mesh, gap: float, patch: int) -> int:
    """Side of the texture that the unit square of a mesh's UVs shows once [texels].

    Args:
        mesh: any.
        gap: between texels, on the mesh in the scene cube.
        patch: side of a patch, which the texture is not smaller than [texels].

    Raises:
        MeshError: the mesh has no area.
        ConfigError: the side is smaller than a patch or larger than 8192.
    """
    texels = round(uv_unit_length(in_scene_cube(laid_out(mesh, UNWRAP_SIZE))[0]) / gap)
    if not patch <= texels <= LARGEST:
        raise ConfigError(
            f"a guide over {texels} x {texels} texels",
            f"use {'smaller' if texels < patch else 'larger'} scales: it takes {patch} to {LARGEST}",
        )
    return texels


# Unwrapping takes seconds, and whether a texture is too fine is asked before it is made.
@lru_cache(maxsize=1)
def own_layout(mesh: Mesh, gap: float, size: int) -> tuple[Mesh, int | None]:
    """The mesh with UVs for a map on it, whatever UVs it has, and the side of the map [texels].

    Args:
        mesh: any.
        gap: between texels of patches, on the mesh in the scene cube; those of the map are as far apart if
            `size` suffices.
        size: of the side, at most.

    Returns:
        Mesh and side; None for the side if texels would be more than 4 times as far apart, which blurs them.

    Raises:
        MeshError: the mesh has no area.
    """
    mesh = laid_out(replace(mesh, uv=None), UNWRAP_SIZE)
    needed = layout_side(in_scene_cube(mesh)[0]) / gap
    if needed > COARSEST * size:
        return mesh, None
    side = int(np.clip(np.ceil(needed), SMALLEST, size))
    assert mesh.uv is not None
    # A texel beside the square's border is left free, so that lookups never read what is on the other side.
    return replace(mesh, uv=(mesh.uv * (side - 2) + 1) / side), side


def carried_picture(picture: np.ndarray, pictured: Mesh, mesh: Mesh, side: int) -> np.ndarray:
    """A picture over a mesh's UVs, on another layout of the same mesh: (side, side, 3), black beside charts.

    Args:
        picture: (H, W, 3).
        pictured: the mesh with the UVs that it lies over.
        mesh: the same faces, with the other UVs.
        side: of the new picture [texels].

    Raises:
        ConfigError: it is no picture.
    """
    image = checked_picture(picture)
    texels = FaceTexels.rasterize(np.asarray(mesh.uv), side)
    places = interpolate(texels.barycentric, np.asarray(pictured.uv)[texels.face])
    carried = np.zeros((side * side, 3), np.float32)
    carried[texels.index] = bilinear(image, places)
    return carried.reshape(side, side, 3)


def too_fine(mesh: Mesh, size: int) -> ConfigError:
    """What is wrong where `own_layout` finds no side."""
    return ConfigError(
        f"elements so small on '{mesh.name}' that a map of {size} x {size} texels blurs them",
        'use larger scales or sizes, or quilting="plane"',
    )
