"""Tangents of a UV layout, and the mesh split where they break.

The convention is that of OpenGL and glTF: the tangent points where u grows, the bitangent where v grows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

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

    def corner_frames(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(F, 3, 3) tangents, bitangents and normals of the face corners."""
        return self.tangents[self.faces, :3], self.bitangents[self.faces], self.normals[self.faces]


def split_at_seams(mesh: Mesh, uv: np.ndarray) -> Split:
    """Splits vertices where their corners differ in UV or in the handedness of the UV layout.

    Args:
        mesh: F faces.
        uv: (F, 3, 2), v upwards.
    """
    corners = uv.reshape(-1, 2).astype(np.float32)
    p, t = mesh.vertices[mesh.faces].astype(np.float64), uv.astype(np.float64)
    dp, dt = p[:, 1:] - p[:, :1], t[:, 1:] - t[:, :1]
    area = dt[:, 0, 0] * dt[:, 1, 1] - dt[:, 0, 1] * dt[:, 1, 0]
    mirrored = area < 0
    # dp/du times the signed UV area: each face weighs in by its size.
    along_u = (dt[:, 1, 1:] * dp[:, 0] - dt[:, 0, 1:] * dp[:, 1]) * np.where(mirrored, -1.0, 1.0)[:, None]
    key = np.empty((len(corners), 4), np.int64)
    key[:, 0] = mesh.faces.reshape(-1)
    key[:, 1:3] = np.ascontiguousarray(corners + np.float32(0.0)).view(np.int32)  # -0.0 becomes 0.0
    key[:, 3] = np.repeat(mirrored, 3)
    _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    source = key[first, 0]
    summed = np.stack(
        [np.bincount(inverse, np.repeat(along_u[:, k], 3), len(first)) for k in range(3)], axis=1
    )
    normals = mesh.normals[source].astype(np.float64)
    handedness = np.where(key[first, 3] == 1, -1.0, 1.0)[:, None]
    return Split(
        source=source,
        uv=corners[first],
        faces=inverse.reshape(-1, 3).astype(np.int32),
        normals=normals.astype(np.float32),
        tangents=np.concatenate([orthonormal(summed, normals), handedness], axis=1).astype(np.float32),
    )
