"""Laplacians in units of cells: of pixels on a torus, and of meshes whose vertices are cells."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from mitex.mesh import Mesh
from mitex.mesh.cotangents import cotangent_weights, vertex_areas

LARGEST = 8.0  # share of a cell that a rate of 1 takes from it, at most; pixels: 4


def grid_laplacian(side: int) -> csr_array:
    """(N^2, N^2) the sum of the four neighbours minus four times the pixel, row by row."""
    number = np.arange(side * side).reshape(side, side)
    shifts = [(1, 0), (1, 1), (-1, 0), (-1, 1)]
    neighbours = np.stack([np.roll(number, shift, axis).ravel() for shift, axis in shifts])
    rows = np.tile(number.ravel(), 4)
    return _with_diagonal(rows, neighbours.ravel(), np.ones(rows.size), side * side)


def mesh_laplacian(mesh: Mesh) -> csr_array:
    """(V, V) the cotangent Laplacian times the mean area of a cell, so that a mean edge is about a pixel.

    Where pixels are cut into triangles, it is `grid_laplacian`. An explicit step of diffusion must not take
    more from a cell than it has: negative weights (of obtuse angles) count as none, and rows of small cells
    are scaled down to `LARGEST`, so that rates up to 1 / `LARGEST` are stable on every mesh.
    """
    count = len(mesh.vertices)
    pairs, weights = cotangent_weights(mesh)
    area = vertex_areas(mesh)
    mean = area.sum() / count
    both = np.concatenate([pairs, pairs[:, ::-1]])
    values = np.tile(np.maximum(weights, 0.0), 2) * (mean / np.maximum(area, 1e-12 * mean))[both[:, 0]]
    total = np.bincount(both[:, 0], values, count)
    values *= np.minimum(1.0, LARGEST / np.maximum(total, 1e-300))[both[:, 0]]
    return _with_diagonal(both[:, 0], both[:, 1], values, count)


def _with_diagonal(rows: np.ndarray, columns: np.ndarray, values: np.ndarray, count: int) -> csr_array:
    """The matrix (count, count) of these entries, and a diagonal by which rows sum to 0."""
    diagonal = np.arange(count)
    rows, columns = np.concatenate([rows, diagonal]), np.concatenate([columns, diagonal])
    values = np.concatenate([values, -np.bincount(rows[: len(values)], values, count)])
    return coo_array((values, (rows, columns)), shape=(count, count)).tocsr()
