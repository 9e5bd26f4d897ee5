"""The captured texture as maps over its own base shape, which gives it back: the check of the whole way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mitex.atlas import Atlas
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh
from mitex.methods.nerf.applied import stretch
from mitex.methods.nerf.maps import CHANNELS, LatentMaps, uv_frames


def own_maps(
    base: Mesh, captured: np.ndarray, features: Callable[[np.ndarray], np.ndarray], size: int
) -> tuple[Mesh, LatentMaps]:
    """Latent maps that repeat what was captured.

    Args:
        base: the base shape.
        captured: (F, 3, 3) T_c of its faces.
        features: points (N, 3) of it -> (N, 24).
        size: side of the maps [texels].

    Returns:
        The base shape with UVs, and the maps for these: one unit of the UVs is the whole map if the mesh
        keeps its size.
    """
    atlas = Atlas.build(base, size)
    mesh = replace(base, uv=atlas.uv)
    shown = atlas.face >= 0
    corners = base.vertices[base.faces[atlas.face[shown]]]
    values = np.zeros((size, size, CHANNELS), np.float32)
    values[shown] = features(interpolate(atlas.barycentric[shown], corners))
    # T_s^-1 T_c: the texture's own axes are those of the charts.
    frames = np.einsum("kij,klj->kil", uv_frames(mesh), captured)
    return mesh, LatentMaps(values, np.maximum(atlas.face, 0), frames, stretch(mesh) / size)
