"""Tangents of a UV layout, and the mesh split where they break.

The convention is that of OpenGL and glTF: the tangent points where u grows, the bitangent where v grows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mitex.geometry.mikktspace import corner_tangents
from mitex.geometry.vectors import orthonormal

if TYPE_CHECKING:
    from mitex.mesh import Mesh  # the type alone: meshes are built on geometry


@dataclass(frozen=True, eq=False)
class Split:
    """A mesh whose vertices are split where the UVs are: what formats with one index per corner need.

    Attributes:
        source: (N,) int64, the vertex of the mesh that each split vertex copies.
        uv: (N, 2) float32, v upwards.
        faces: (F, 3) int32 into the split vertices.
        normals: (N, 3) float32, smooth normals of the unsplit mesh.
        tangents: (N, 4) float32, unit, across the normal; the last is the handedness: the bitangent is
            w * cross(normal, tangent), exactly as glTF defines its TANGENT.
    """

    source: np.ndarray
    uv: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray

    @property
    def bitangents(self) -> np.ndarray:
        """(N, 3) float32, unit."""
        return self.tangents[:, 3:] * np.cross(self.normals, self.tangents[:, :3])


def split_at_seams(mesh: Mesh, uv: np.ndarray) -> Split:
    """Splits vertices where their corners differ in UV or in their MikkTSpace tangents.

    Where the UVs have no area, any direction across the normal is the tangent.

    Args:
        mesh: F faces.
        uv: (F, 3, 2), v upwards.
    """
    uv = uv.astype(np.float32)
    corners = corner_tangents(mesh.vertices, mesh.normals, mesh.faces, uv)
    # A fan has one UV, but its vertices may be several at one place.
    key = mesh.faces.astype(np.int64) * (corners.fans.max(initial=0) + 1) + corners.fans
    _, first, inverse = np.unique(key.ravel(), return_index=True, return_inverse=True)
    source = mesh.faces.ravel()[first].astype(np.int64)
    normals = mesh.normals[source].astype(np.float64)
    tangents = orthonormal(corners.vectors.reshape(-1, 3)[first], normals)
    return Split(
        source=source,
        uv=uv.reshape(-1, 2)[first],
        faces=inverse.reshape(-1, 3).astype(np.int32),
        normals=normals.astype(np.float32),
        tangents=np.concatenate([tangents, corners.signs.reshape(-1, 1)[first]], axis=1).astype(np.float32),
    )
