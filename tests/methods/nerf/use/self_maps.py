"""A captured texture as maps over its own base shape, which repeat what was captured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mitex.atlas import Atlas
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.synthesis.maps import CHANNELS, LatentMaps, uv_frames
from mitex.methods.nerf.use.applied import AppliedTexture
from mitex.methods.nerf.use.placement import EXTENT, uv_unit_length


def on_base_shape(texture: NerfTexture, size: int) -> AppliedTexture:
    """The captured texture as maps of `size` texels on its own base shape, in the scene cube."""
    mesh, maps = self_maps(texture, size)
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    return texture.apply(mesh, maps, scale=2 * EXTENT / float((high - low).max()), lift=0.0)


def self_maps(texture: NerfTexture, size: int) -> tuple[Mesh, LatentMaps]:
    """The base shape with UVs, and maps of `size` texels for these: one unit of the UVs is the whole map if
    the mesh keeps its size.
    """
    base = texture.model.base.mesh
    atlas = Atlas.build(base, size)
    mesh = replace(base, uv=atlas.uv)
    occupied = atlas.face >= 0
    corners = base.vertices[base.faces[atlas.face[occupied]]]
    values = np.zeros((size, size, CHANNELS), np.float32)
    values[occupied] = texture.features(interpolate(atlas.barycentric[occupied], corners))
    # T_s^-1 T_c: the texture's own axes are those of the charts.
    turns = np.einsum("kij,klj->kil", uv_frames(mesh), texture.model.frames)
    return mesh, LatentMaps(values, np.maximum(atlas.face, 0), turns, uv_unit_length(mesh) / size)
