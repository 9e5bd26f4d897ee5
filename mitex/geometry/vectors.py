"""Vectors in rows of arrays: lengths, planes, rotations, and sums over groups of rows."""

from __future__ import annotations

import numpy as np


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(...,) scalar products of vectors (..., C)."""
    return np.einsum("...k,...k->...", a, b)


def cross_2d(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(...,) signed areas of the parallelograms of vectors (..., 2), positive if b is to the left of a."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def unit(v: np.ndarray) -> np.ndarray:
    """Vectors (..., C) divided by their length; zero stays zero."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return v / np.where(length > 0.0, length, 1.0)


def unit_normals(v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) divided by their length; +z where that is zero."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(length > 0.0, v / np.where(length > 0.0, length, 1.0), np.array([0.0, 0.0, 1.0], v.dtype))


def across(v: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The vectors (..., 3) projected onto the planes across the unit normals (..., 3)."""
    return v - normals * dot(normals, v)[..., None]


def orthonormal(tangents: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3) across the unit normals, nearest to the tangents (..., 3) of any length.

    Where a tangent is zero or along its normal, any direction across the normal is taken, always the same.
    """
    projected = across(tangents, normals)
    # The axis that the normal is farthest from is never parallel to it.
    axis = np.eye(3, dtype=normals.dtype)[np.abs(normals).argmin(axis=-1)]
    length = np.linalg.norm(projected, axis=-1, keepdims=True)
    scale = np.maximum(np.linalg.norm(tangents, axis=-1, keepdims=True), 1e-20)
    return unit(np.where(length > 1e-6 * scale, projected, across(axis, normals)))


def rotate_about(vectors: np.ndarray, axes: np.ndarray, angle: float | np.ndarray) -> np.ndarray:
    """Vectors (N, 3) turned counter-clockwise about unit axes (N, 3) by `angle` [rad], one or (N,).

    Rodrigues' formula.
    """
    cos, sin = np.cos(angle), np.sin(angle)
    if np.ndim(angle):
        cos, sin = cos[:, None], sin[:, None]
    along = (vectors * axes).sum(axis=1, keepdims=True)
    return vectors * cos + np.cross(axes, vectors) * sin + axes * along * (1 - cos)


def scatter_add(index: np.ndarray, rows: np.ndarray, count: int) -> np.ndarray:
    """(count, C) float64 sums of the rows (N, C) that have the same index (N,); zeros where none has."""
    return np.stack([np.bincount(index, column, count) for column in rows.T], axis=1)
