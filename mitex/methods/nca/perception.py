"""Mesh perception: spherical harmonics of edge directions as one sparse product (MeshNCA, equations 1 and 2).

Vertex i perceives z_i = sum_j w(d_ij) (s_j - s_i) for each harmonic w, where the sum goes over its neighbours
j, and d_ij = (p_j - p_i) / |p_j - p_i|. That is linear in the states s: one sparse matrix of shape
(V * blocks, V) gives all harmonics, and the state itself as a last block; row i * blocks + k is block k of
vertex i. Its transpose is kept too: it is the backward pass. No tensor of edges times channels is formed.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.geometry.vectors import rotate_about, scatter_add
from mitex.mesh import Lattice, Mesh
from mitex.sparse import csr_tensor

REGULAR = 6.0  # valence of a regular mesh
HARMONICS = {0: 1, 1: 4, 2: 9}  # highest degree -> number of harmonics


@dataclass(frozen=True, eq=False)
class Perception:
    """The perception operator of a mesh.

    Attributes:
        matrix: (V * blocks, V) sparse CSR; `blocks` is the number of harmonics plus one, the state itself.
        adjoint: (V, V * blocks) sparse CSR, its transpose.
        vertices: V.
        blocks: rows for each vertex.
    """

    matrix: torch.Tensor
    adjoint: torch.Tensor
    vertices: int
    blocks: int

    def __call__(self, state: torch.Tensor) -> torch.Tensor:
        """State (B, V, C) -> (B, V, blocks * C): harmonics in order, then the state."""
        batch, vertices, channels = state.shape
        flat = state.transpose(0, 1).reshape(vertices, batch * channels)
        perceived = (self.matrix @ flat).view(vertices, self.blocks, batch, channels)
        return perceived.permute(2, 0, 1, 3).reshape(batch, vertices, self.blocks * channels)

    def transposed(self, perceived: torch.Tensor) -> torch.Tensor:
        """The adjoint of `__call__`: (B, V, blocks * C) -> (B, V, C)."""
        batch, vertices, width = perceived.shape
        channels = width // self.blocks
        flat = perceived.view(batch, vertices, self.blocks, channels).permute(1, 2, 0, 3)
        flat = flat.reshape(vertices * self.blocks, batch * channels)
        return (self.adjoint @ flat).view(vertices, batch, channels).transpose(0, 1)


def harmonics(directions: np.ndarray, degree: int) -> np.ndarray:
    """Real spherical harmonics (E, count) of unit vectors (E, 3), without constant factors, as the authors'.

    Order: 1; y, z, x; xy, yz, 3z^2 - 1, xz, x^2 - y^2. Up to `degree` 0, 1 or 2.
    """
    x, y, z = directions.T
    terms = [np.ones_like(x), y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y]
    return np.stack(terms[: HARMONICS[degree]], axis=1)


_cache: weakref.WeakKeyDictionary[Mesh, dict[tuple, Perception]] = weakref.WeakKeyDictionary()


def perception(
    mesh: Mesh,
    degree: int = 1,
    orientation: float | np.ndarray = 0.0,
    device: torch.device | str = "cpu",
    mean: bool = False,
) -> Perception:
    """The perception operator of a mesh; kept as long as the mesh lives.

    Args:
        mesh: any triangle mesh; vertices without edges perceive zeros.
        degree: highest degree of the harmonics: 0, 1 (the paper) or 2 (its ablation).
        orientation: turns the texture about the vertex normals by this angle [rad], one or (V,): edge
            directions are turned back by it before the harmonics are evaluated.
        device: of the matrices.
        mean: six times the mean over the neighbours instead of their sum (Cells2Pixels): the same on a
            regular mesh, and of the same size at any valence.

    Raises:
        ConfigError: unknown degree, orientations that do not fit the mesh or are not finite.
    """
    if degree not in HARMONICS:
        raise ConfigError(f"spherical harmonics of degree {degree}", "use 0, 1 or 2")
    if np.ndim(orientation) and np.shape(orientation) != (len(mesh.vertices),):
        raise ConfigError(f"orientations of shape {np.shape(orientation)}", "give one angle, or one a vertex")
    if not np.isfinite(orientation).all():
        raise ConfigError("an orientation that is not finite", "give finite angles")
    key = (degree, np.asarray(orientation, np.float64).tobytes(), str(device), mean)
    operators = _cache.setdefault(mesh, {})
    if key not in operators:
        matrix = _matrix(mesh, degree, orientation, mean)
        operators[key] = _operator(matrix, len(mesh.vertices), device)
    return operators[key]


def lattice_perception(
    lattice: Lattice, degree: int = 1, mean: bool = False, device: torch.device | str = "cpu"
) -> Perception:
    """The perception operator of the vertices in the square of a lattice: those at its sides have the ones at
    the opposite sides as neighbours. Arguments as of `perception`.
    """
    import scipy.sparse

    count, blocks = lattice.count, HARMONICS[degree] + 1
    matrix = _matrix(lattice.mesh, degree, 0.0, mean)[: count * blocks]
    entries = matrix.data, lattice.source[matrix.indices], matrix.indptr
    return _operator(scipy.sparse.csr_array(entries, shape=(count * blocks, count)), count, device)


def _operator(matrix: Any, vertices: int, device: torch.device | str = "cpu") -> Perception:
    blocks = matrix.shape[0] // vertices
    return Perception(csr_tensor(matrix, device), csr_tensor(matrix.T.tocsr(), device), vertices, blocks)


def _matrix(mesh: Mesh, degree: int, orientation: float | np.ndarray, mean: bool) -> Any:
    """(V * blocks, V) scipy CSR."""
    import scipy.sparse

    count, blocks = len(mesh.vertices), HARMONICS[degree] + 1
    neighbours = np.asarray(mesh.edges.indices)
    receivers = np.repeat(np.arange(count), np.diff(mesh.edges.indptr))
    positions = mesh.vertices.astype(np.float64)
    offsets = positions[neighbours] - positions[receivers]
    # No constant is added to the lengths (the authors: 1e-8): meshes may have any size.
    lengths = np.linalg.norm(offsets, axis=1, keepdims=True)
    directions = offsets / np.where(lengths > 0.0, lengths, 1.0)
    if np.any(orientation):
        angle = np.broadcast_to(orientation, (count,))[receivers]
        directions = rotate_about(directions, mesh.normals.astype(np.float64)[receivers], -angle)
    weights = harmonics(directions, degree)
    if mean:
        weights *= (REGULAR / np.maximum(np.diff(mesh.edges.indptr), 1))[receivers, None]
    centre = scatter_add(receivers, weights, count)
    own = np.arange(count)
    first_rows = receivers[:, None] * blocks + np.arange(blocks - 1)
    own_rows = own[:, None] * blocks + np.arange(blocks)
    rows = np.concatenate([first_rows.ravel(), own_rows.ravel()])
    columns = np.concatenate([np.repeat(neighbours, blocks - 1), np.repeat(own, blocks)])
    own_weights = np.concatenate([-centre, np.ones((count, 1))], axis=1)
    values = np.concatenate([weights.ravel(), own_weights.ravel()]).astype(np.float32)
    return scipy.sparse.csr_array((values, (rows, columns)), shape=(count * blocks, count))
