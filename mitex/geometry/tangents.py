"""Tangents of a UV layout, and the mesh split at hard edges and where tangents break.

The convention is that of OpenGL and glTF: the tangent points where u grows, the bitangent where v grows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mitex.geometry.mikktspace import corner_tangents, numbered
from mitex.geometry.vectors import orthonormal

if TYPE_CHECKING:
    from mitex.mesh import Mesh  # the type alone: meshes are built on geometry


@dataclass(frozen=True, eq=False)
class HardSplit:
    """A mesh whose vertices are split at hard edges, so that each has one normal to shade with.

    Attributes:
        source: (N,) int64, the vertex of the mesh that each split vertex copies, ascending.
        faces: (F, 3) int32 into the split vertices.
        normals: (N, 3) float32, the normals that they are shaded with.
    """

    source: np.ndarray
    faces: np.ndarray
    normals: np.ndarray


@dataclass(frozen=True, eq=False)
class Split(HardSplit):
    """A mesh whose vertices are also split where the UVs are: what formats with one index per corner need.

    Attributes:
        uv: (N, 2) float32, v upwards.
        tangents: (N, 4) float32, unit, across the normal; the last is the handedness: the bitangent is
            w * cross(normal, tangent), exactly as glTF defines its TANGENT.
    """

    uv: np.ndarray
    tangents: np.ndarray

    @property
    def bitangents(self) -> np.ndarray:
        """(N, 3) float32, unit."""
        return self.tangents[:, 3:] * np.cross(self.normals, self.tangents[:, :3])


def split_at_hard_edges(mesh: Mesh) -> HardSplit:
    """Splits vertices where their corners have different normals; without corner normals nowhere."""
    if mesh.corner_normals is None:
        return HardSplit(np.arange(len(mesh.vertices)), mesh.faces, mesh.normals)
    normals = mesh.corner_normals.reshape(-1, 3) + np.float32(0.0)  # -0.0 is 0.0
    split = numbered([*normals.view(np.int32).T, mesh.faces.ravel()])
    _, first = np.unique(split, return_index=True)
    source = mesh.faces.ravel()[first].astype(np.int64)
    return HardSplit(source, split.reshape(-1, 3).astype(np.int32), normals[first])


def split_at_seams(mesh: Mesh, uv: np.ndarray) -> Split:
    """Splits vertices where their corners differ in normal, UV, or MikkTSpace tangent.

    Where the UVs have no area, any direction across the normal is the tangent.

    Args:
        mesh: F faces.
        uv: (F, 3, 2), v upwards.
    """
    uv = uv.astype(np.float32)
    hard = split_at_hard_edges(mesh)
    corners = corner_tangents(mesh.vertices[hard.source], hard.normals, hard.faces, uv)
    # A fan has one UV, but its vertices may be several at one place.
    key = hard.faces.astype(np.int64) * (corners.fans.max(initial=0) + 1) + corners.fans
    _, first, inverse = np.unique(key.ravel(), return_index=True, return_inverse=True)
    vertex = hard.faces.ravel()[first]
    normals = hard.normals[vertex].astype(np.float64)
    tangents = orthonormal(corners.vectors.reshape(-1, 3)[first], normals)
    return Split(
        source=hard.source[vertex],
        uv=uv.reshape(-1, 2)[first],
        faces=inverse.reshape(-1, 3).astype(np.int32),
        normals=normals.astype(np.float32),
        tangents=np.concatenate([tangents, corners.signs.reshape(-1, 1)[first]], axis=1).astype(np.float32),
    )
