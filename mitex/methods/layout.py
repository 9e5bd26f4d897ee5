"""The UV layout that textures of one mesh share: a texel is as large on the surface for all methods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mitex.atlas import unwrap, usable_uv
from mitex.errors import ConfigError
from mitex.mesh import Mesh

PADDING = 2  # texels between charts: bilinear taps of one never see the other


def with_layout(mesh: Mesh, resolution: int, keep_uvs: bool = False) -> Mesh:
    """The mesh with the UVs that its texels shall have.

    Args:
        mesh: any mesh.
        resolution: side of the map that new charts are packed for [texels].
        keep_uvs: use the mesh's own UVs.

    Raises:
        ConfigError: its own are wanted but missing, out of range or overlapping.
    """
    if not keep_uvs:
        return replace(mesh, uv=unwrap(mesh, resolution, PADDING))
    if mesh.uv is None:
        raise ConfigError(f"mesh '{mesh.name}' has no UVs to keep", "leave out `keep_uvs`")
    if not usable_uv(mesh, mesh.uv):
        raise ConfigError(
            f"the UVs of mesh '{mesh.name}' overlap, leave [0, 1] or are incomplete",
            "leave out `keep_uvs` to have it unwrapped",
        )
    return mesh


def same_surface(a: Mesh, b: Mesh) -> bool:
    """Whether two meshes have the same vertices and faces."""
    return np.array_equal(a.vertices, b.vertices) and np.array_equal(a.faces, b.faces)
