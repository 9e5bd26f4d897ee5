"""Sparse matrices of a mesh's edges; vertices are rows and columns."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from mitex.mesh.mesh import Mesh
from mitex.mesh.topology import mesh_edges


def edge_lengths(faces: np.ndarray, places: np.ndarray) -> csr_array:
    """(V, V), symmetric, of the edges of faces (F, 3) between places (V, 3)."""
    pairs, _ = mesh_edges(faces, len(places))
    length = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
    graph = coo_array((length, tuple(pairs.T)), shape=(len(places),) * 2).tocsr()
    return csr_array(graph + graph.T)


def ring_means(mesh: Mesh) -> csr_array:
    """(V, V): the mean over each vertex's neighbours."""
    edges = mesh.edges
    weights = np.repeat(1.0 / np.maximum(edges.valence, 1), edges.valence)
    return csr_array((weights, edges.indices, edges.indptr), shape=(len(edges.valence),) * 2)
