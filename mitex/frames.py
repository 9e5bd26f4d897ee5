"""Tangent frames: object-space detail normals from encoded ones, and back, per vertex and on an atlas.

A frame is (tangent, bitangent, normal). The convention is that of OpenGL and glTF: the tangent points where
u grows, the bitangent where v grows (up in the image), and a map stores (n + 1) / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.atlas import Atlas
from mitex.geometry.mikktspace import corner_tangents
from mitex.mesh import Mesh

FLAT = (0.5, 0.5, 1.0)  # the normal map of an even surface
MIN_Z = 0.05  # detail normals stay this far above the surface: maps cannot show an overhang


def unit(v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) divided by their length; zero stays zero."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-20)


def orthonormal(tangents: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Tangents (..., 3) projected onto the plane across the unit normals; any across where that vanishes."""
    projected = tangents - normals * (normals * tangents).sum(axis=-1, keepdims=True)
    # The axis that the normal is farthest from is never parallel to it.
    axis = np.eye(3, dtype=normals.dtype)[np.abs(normals).argmin(axis=-1)]
    spare = axis - normals * (normals * axis).sum(axis=-1, keepdims=True)
    length = np.linalg.norm(projected, axis=-1, keepdims=True)
    scale = np.maximum(np.linalg.norm(tangents, axis=-1, keepdims=True), 1e-20)
    return unit(np.where(length > 1e-6 * scale, projected, spare))


def decode(encoded: np.ndarray, tangent: np.ndarray, bitangent: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Unit object-space normals (..., 3) from map values in [0, 1] and the frame at each."""
    n = _upward(2.0 * encoded - 1.0)
    return unit(n[..., 0:1] * tangent + n[..., 1:2] * bitangent + n[..., 2:3] * normal)


def encode(detail: np.ndarray, tangent: np.ndarray, bitangent: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Map values (..., 3) in [0, 1] from which `decode` gives the unit normals `detail` back.

    The frame need not be orthogonal (interpolated ones are not quite). Normals below the surface are
    lifted to `MIN_Z`.
    """
    # Rows of the inverse frame, by Cramer's rule: a million 3x3 solves would take seconds.
    x, y, z = np.cross(bitangent, normal), np.cross(normal, tangent), np.cross(tangent, bitangent)
    determinant = (tangent * x).sum(axis=-1, keepdims=True)
    local = np.stack([(detail * row).sum(axis=-1) for row in (x, y, z)], axis=-1)
    local = np.where(np.abs(determinant) > 1e-3, local * np.sign(determinant), (0.0, 0.0, 1.0))
    return (0.5 + 0.5 * _upward(local)).astype(np.float32)


def _upward(n: np.ndarray) -> np.ndarray:
    n = unit(n)
    return unit(np.concatenate([n[..., :2], np.maximum(n[..., 2:], MIN_Z)], axis=-1))


def vertex_detail(mesh: Mesh, tangents: np.ndarray, encoded: np.ndarray) -> np.ndarray:
    """Object-space detail normals of a map given per vertex.

    Args:
        mesh: V vertices.
        tangents: (V, 3), where the map's +u points.
        encoded: (V, 3) map values in [0, 1].

    Returns:
        (V, 3) float32, unit.
    """
    normals = mesh.normals
    t = orthonormal(tangents, normals)
    return decode(encoded, t, np.cross(normals, t), normals).astype(np.float32)


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


def shading_frames(mesh: Mesh, atlas: Atlas) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, N, 3) tangents, bitangents and normals of an atlas, as shaders that follow MikkTSpace have them.

    Tangent and normal are interpolated and not normalised; the bitangent is sign * cross(normal, tangent) in
    each texel.
    """
    split = split_at_seams(mesh, atlas.uv)
    tangent, normal = (atlas.interpolate(v[split.faces]) for v in (split.tangents[:, :3], split.normals))
    sign = split.tangents[split.faces[:, 0], 3][atlas.face][..., None]
    return tangent, sign * np.cross(normal, tangent), normal


def atlas_normals(mesh: Mesh, atlas: Atlas, detail: np.ndarray) -> np.ndarray:
    """The normal map of an atlas.

    Args:
        mesh: the atlas' mesh.
        atlas: the layout.
        detail: (N, N, 3) detail normals in object space, of any length; anything where no chart is near.

    Returns:
        (N, N, 3) in [0, 1], in the `shading_frames`.
    """
    encoded = encode(unit(detail), *shading_frames(mesh, atlas))
    encoded[atlas.face < 0] = FLAT
    return encoded
