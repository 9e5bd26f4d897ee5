"""Normal maps: object-space detail normals from encoded ones, and back.

A frame is (tangent, bitangent, normal). The convention is that of OpenGL and glTF: the tangent points where
u grows, the bitangent where v grows (up in the image), and a map stores (n + 1) / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.geometry.vectors import orthonormal, unit

FLAT = (0.5, 0.5, 1.0)  # the normal map of an even surface
LEAST = 0.1  # of the mean normal, along the surface's own
ROUNDING = 0.01  # of 8 bits, whose neutral 127 or 128 is no half
CLEAR = 0.25  # a correlation of slopes that means something; those of 22 materials are 0.20 to 0.96
MARGIN = 0.1  # by which one correlation is larger than another
BELOW = 0.05  # share of normals that may point into the surface
MIN_Z = 0.05  # detail normals stay this far above the surface: maps cannot show an overhang


def is_normal_map(encoded: np.ndarray) -> bool:
    """Whether map values (H, W, 3) in [0, 1] are normals in tangent space.

    Of such ones nearly all point out of the surface, and their mean more than to any side: swapped channels
    and heights do neither.
    """
    n = 2.0 * encoded.reshape(-1, 3) - 1.0
    x, y, z = np.abs(n.mean(axis=0, dtype=np.float64)) * (1, 1, np.sign(n[:, 2].mean(dtype=np.float64)))
    return bool(z > max(x, y, LEAST) and (n[:, 2] > -ROUNDING).mean() > 1 - BELOW)


@dataclass(frozen=True)
class SlopeAgreement:
    """How far normals are those of a height, whose mixed derivatives are equal.

    Attributes:
        upward: correlation of these derivatives if green points up (OpenGL); negative if it points down.
        across: the same with red and green exchanged; nearer to 0 unless they are exchanged indeed.
    """

    upward: float
    across: float

    @property
    def downward(self) -> bool:
        """Green points down, as in DirectX."""
        return self.upward < -CLEAR

    @property
    def exchanged(self) -> bool:
        """Red and green are exchanged."""
        return abs(self.across) > CLEAR and abs(self.across) > abs(self.upward) + MARGIN


def slope_agreement(encoded: np.ndarray) -> SlopeAgreement:
    """The `SlopeAgreement` of map values (H, W, 3) in [0, 1], row 0 on top."""
    rises = slopes(encoded)
    along_x = (np.roll(rises, -1, 1) - np.roll(rises, 1, 1))[1:-1, 1:-1]
    along_y = (np.roll(rises, 1, 0) - np.roll(rises, -1, 0))[1:-1, 1:-1]

    def correlation(a: np.ndarray, b: np.ndarray) -> float:
        return float((a * b).mean() / np.sqrt(max((a * a).mean() * (b * b).mean(), 1e-20)))

    return SlopeAgreement(
        correlation(along_y[..., 0], along_x[..., 1]), correlation(along_y[..., 1], along_x[..., 0])
    )


def slopes(encoded: np.ndarray) -> np.ndarray:
    """How much the surface of map values (..., 3) in [0, 1] rises to the right and upwards, (..., 2) float64.

    Normals that are flatter than `LEAST` count as if they were not.
    """
    n = 2.0 * encoded.astype(np.float64) - 1.0
    return -n[..., :2] / np.maximum(n[..., 2:], LEAST)


def of_slopes(rises: np.ndarray) -> np.ndarray:
    """Map values (..., 3) float32 of a surface that rises by (..., 2); the inverse of `slopes`."""
    normals = unit(np.concatenate([-rises, np.ones_like(rises[..., :1])], axis=-1))
    return (0.5 + 0.5 * normals).astype(np.float32)


def rotated(encoded: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Map values (..., 3) of what is turned counter-clockwise in its plane by angles (...) [rad]."""
    x, y = np.moveaxis(encoded[..., :2] - 0.5, -1, 0)
    sine, cosine = np.sin(angle), np.cos(angle)
    along = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
    return np.concatenate([0.5 + along, encoded[..., 2:]], axis=-1)


def decode(encoded: np.ndarray, tangent: np.ndarray, bitangent: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Unit object-space normals (..., 3) from map values (..., 3) in [0, 1] and the frame at each."""
    n = _upward(2.0 * encoded - 1.0)
    return unit(n[..., 0:1] * tangent + n[..., 1:2] * bitangent + n[..., 2:3] * normal)


def decode_at_vertices(encoded: np.ndarray, tangents: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Object-space detail normals of a map given per vertex.

    Args:
        encoded: (V, 3) map values in [0, 1].
        tangents: (V, 3), where the map's +u points.
        normals: (V, 3) of the mesh, unit.

    Returns:
        (V, 3) float32, unit.
    """
    t = orthonormal(tangents, normals)
    return decode(encoded, t, np.cross(normals, t), normals).astype(np.float32)


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
