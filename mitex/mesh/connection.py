"""Tangent vectors at the vertices as complex numbers, carried along the edges of a mesh.

The discrete Levi-Civita connection of Knoppel, Crane, Pinkall and Schroder, "Globally optimal direction
fields" (2013), with the smallest rotation between the normals of two vertices in place of their angles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mitex.geometry.vectors import dot, orthonormal

FOLD = 1e-6  # 1 + cos between normals: nothing is carried over edges folded onto themselves


def tangent_axes(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two axes x and y across each of the unit normals (V, 3), with x x y = n; x + i y are 1 and i there."""
    x = orthonormal(np.zeros_like(normals), normals)
    return x, np.cross(normals, x)


def transport(normals: np.ndarray, x: np.ndarray, y: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(E,) r_ij: the number that the x axis of j becomes in the plane of i; 0 over folded edges.

    Args:
        normals: (V, 3) unit.
        x: (V, 3), and
        y: (V, 3), the `tangent_axes`.
        edges: (E, 2) vertex pairs i, j.
    """
    i, j = edges.T
    cos1 = 1.0 + dot(normals[i], normals[j])
    carried = x[j] - (dot(x[j], normals[i]) / np.maximum(cos1, FOLD))[:, None] * (normals[i] + normals[j])
    return np.where(cos1 > FOLD, dot(carried, x[i]) + 1j * dot(carried, y[i]), 0.0)


def connection_laplacian(edges: np.ndarray, carried: np.ndarray, weights: np.ndarray, count: int) -> Any:
    """The Hermitian matrix L with u* L u = sum_edges w_ij |u_i - r_ij u_j|^2, (V, V) scipy CSC.

    Args:
        edges: (E, 2) vertex pairs i, j.
        carried: (E,) r_ij by `transport`; edges where it is 0 do not count.
        weights: (E,) w_ij, positive.
        count: V.
    """
    from scipy.sparse import coo_array

    used = carried != 0
    edges, weights = edges[used], weights[used]
    i, j = edges.T
    off, own = -weights * carried[used], np.arange(count)
    values = [off, off.conj(), np.bincount(edges.ravel(), np.repeat(weights, 2), count)]
    indices = np.concatenate([i, j, own]), np.concatenate([j, i, own])
    return coo_array((np.concatenate(values), indices), (count, count)).tocsc()


def solver(matrix: Any) -> Callable[[np.ndarray], np.ndarray]:
    """Solves systems of a Hermitian and positive definite matrix, scipy's CSC; right sides (V,) or (V, K)."""
    from scipy.sparse.linalg import splu

    # Without pivoting. SuperLU's other order, minimum degree, is up to twice as fast, but does not end on
    # some meshes that were split.
    return splu(matrix, "COLAMD", diag_pivot_thresh=0.0).solve
