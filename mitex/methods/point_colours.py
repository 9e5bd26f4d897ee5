"""Textures of methods that know a colour for each point of a surface."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mitex.asset import Asset
from mitex.atlas import Atlas
from mitex.export.common import asset_from_textures
from mitex.mesh import Mesh


def with_colours(
    mesh: Mesh, resolution: int, colours: Callable[[np.ndarray], np.ndarray], name: str
) -> Asset:
    """A mesh with an albedo.

    Args:
        mesh: with UVs.
        resolution: side of the albedo [texels].
        colours: points of the surface (N, 3) -> (N, 3) sRGB in [0, 1].
        name: of the asset.
    """
    assert mesh.uv is not None
    atlas = Atlas.from_uv(mesh.uv, resolution)
    used = atlas.face >= 0
    at_texels = colours(atlas.interpolate(mesh.vertices[mesh.faces])[used])
    albedo = np.empty((resolution, resolution, 3), np.float32)
    albedo[:] = at_texels.mean(0)
    albedo[used] = at_texels
    return asset_from_textures(mesh, mesh.uv, {"albedo": albedo}, name)
