"""The relief that a height map tells, as geometry: for programs and printers that displace nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy import ndimage

from mitex.asset import Asset, clay
from mitex.errors import ConfigError
from mitex.export.common import asset_from_textures
from mitex.geometry.triangles import twice_area
from mitex.geometry.vectors import scatter_add
from mitex.images import bilinear
from mitex.mesh import Mesh, subdivide_midpoint
from mitex.ranges import DISPLACEMENTS

BUMPS = ("height", "normal")  # maps that are on the mesh then
FACES = 400_000  # that the mesh is split into, about, where its texels are as fine


def embossed(asset: Asset, relief: float, faces: int = FACES) -> Asset:
    """The asset with its height map as geometry.

    The mesh's faces are split in four until there are about as many as asked for, or until they are as fine
    as the texels. Each vertex moves along its normal; mean heights stay where they are. UVs and the other
    maps are kept, but for the normal map: its bumps are on the mesh now.

    Args:
        asset: with a height map; it is baked first if it has no textures.
        relief: its depth, from the lowest to the highest value of a height map [radii of the mesh];
            negative turns it inside out.
        faces: how many there shall be, about, at most twice as many.

    Raises:
        ConfigError: there is no height map, or the relief is too deep.
    """
    least, most = DISPLACEMENTS
    if not least <= relief <= most:
        raise ConfigError(f"a relief of {relief:g} radii", f"use {least} to {most}")
    asset = asset if asset.texture_maps is not None else asset.baked()
    mesh, height = vertex_heights(asset, faces)
    assert mesh.uv is not None and asset.texture_maps is not None
    offset = relief * asset.mesh.normalised()[1].scale * height
    moved = mesh.with_vertices(mesh.vertices + offset[:, None].astype(np.float32) * mesh.normals)
    maps = {name: values for name, values in asset.texture_maps.items() if name not in BUMPS}
    return asset_from_textures(moved, mesh.uv, maps, asset.name) if maps else clay(moved)


def vertex_heights(asset: Asset, faces: int = FACES) -> tuple[Mesh, np.ndarray]:
    """The mesh of an asset with finer faces, as of `embossed`, and what its height map says at the vertices.

    Args:
        asset: with textures.
        faces: as of `embossed`.

    Returns:
        The mesh with the UVs of the textures, and (V,) float64 heights, from -1 to 1 and 0 in the mean over
        the surface; the same on all sides of a seam.

    Raises:
        ConfigError: there is no height map.
    """
    if "height" not in asset.maps:
        raise ConfigError(
            f"the texture has no height map; it has {', '.join(asset.maps)}",
            "learn it from an exemplar that has one",
        )
    assert asset.atlas is not None and asset.texture_maps is not None
    mesh = split_faces(replace(asset.mesh, uv=asset.atlas.uv), asset.atlas.resolution, faces)
    height = at_vertices(asset.texture_maps["height"], mesh)[:, 0]
    return mesh, height - _mean(height, mesh)


def at_vertices(image: np.ndarray, mesh: Mesh) -> np.ndarray:
    """The values (V, c) float64 of a map (N, N, c) at the vertices of a mesh with UVs.

    Vertices whose neighbours are several texels away get what lies around them on average; those on a seam
    the mean over its sides, so that the surface stays closed.
    """
    assert mesh.uv is not None
    blur = 0.5 * _texels_per_edge(mesh, len(image))
    blurred = ndimage.gaussian_filter(image, (blur, blur, 0))
    corners = mesh.faces.ravel()
    count = np.maximum(np.bincount(corners, minlength=len(mesh.vertices)), 1)
    total = scatter_add(corners, bilinear(blurred, mesh.uv.reshape(-1, 2)).astype(np.float64), len(count))
    return total / count[:, None]


def split_faces(mesh: Mesh, side: int, faces: int) -> Mesh:
    """The mesh with faces as fine as a map's texels, or with up to twice `faces` of them."""
    allowed = math.floor(math.log(max(2 * faces / max(len(mesh.faces), 1), 1), 4))
    useful = math.ceil(math.log2(max(_texels_per_edge(mesh, side), 1)))
    return subdivide_midpoint(mesh, min(allowed, useful))


def _texels_per_edge(mesh: Mesh, side: int) -> float:
    """Of a face of median size, if it were equilateral."""
    assert mesh.uv is not None
    area = float(np.median(np.abs(twice_area(mesh.uv)))) if len(mesh.faces) else 0.0
    return side * math.sqrt(2 * area / math.sqrt(3))


def _mean(height: np.ndarray, mesh: Mesh) -> float:
    """Over the surface, of values (V,) at the vertices; 0 if it has no area."""
    weights = mesh.face_areas.astype(np.float64)
    total = float(weights.sum())
    return float(height[mesh.faces].mean(axis=1) @ weights) / total if total > 0 else 0.0
