"""Latent maps over a texture's own base shape, which repeat what was captured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mitex.atlas import Atlas
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh
from mitex.methods.nerf.synthesis.maps import CHANNELS, LatentMaps, uv_frames
from mitex.methods.nerf.use.placement import uv_unit_length


def self_maps(
    base: Mesh, frames: np.ndarray, features: Callable[[np.ndarray], np.ndarray], size: int
) -> tuple[Mesh, LatentMaps]:
    """Latent maps that repeat what was captured.

    Args:
        base: the base shape.
        frames: (F, 3, 3) T_c of its faces.
        features: points (N, 3) of it -> (N, 24).
        size: side of the maps [texels].

    Returns:
        The base shape with UVs, and the maps for these: one unit of the UVs is the whole map if the mesh
        keeps its size.
    """
    atlas = Atlas.build(base, size)
    mesh = replace(base, uv=atlas.uv)
    occupied = atlas.face >= 0
    corners = base.vertices[base.faces[atlas.face[occupied]]]
    values = np.zeros((size, size, CHANNELS), np.float32)
    values[occupied] = features(interpolate(atlas.barycentric[occupied], corners))
    # T_s^-1 T_c: the texture's own axes are those of the charts.
    turns = np.einsum("kij,klj->kil", uv_frames(mesh), frames)
    return mesh, LatentMaps(values, np.maximum(atlas.face, 0), turns, uv_unit_length(mesh) / size)
