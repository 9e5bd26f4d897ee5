"""What is connected with what: neighbourhoods, components, boundaries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.geometry.constant import sealed


@dataclass(frozen=True, eq=False)
class EdgeGraph:
    """Directed edges j -> i in compressed sparse rows (CSR); both directions of every mesh edge are there.

    Attributes:
        indptr: (V + 1,) int64; the row of the receiving vertex i is `indices[indptr[i]:indptr[i + 1]]`.
        indices: (E,) int64; its neighbours j, ascending, without repetition and without i itself.
    """

    indptr: np.ndarray
    indices: np.ndarray

    def __post_init__(self) -> None:
        sealed(self.indptr)
        sealed(self.indices)

    @property
    def rows(self) -> np.ndarray:
        """(E,) int64 receiving vertex i of every edge."""
        return np.repeat(np.arange(len(self.indptr) - 1), self.valence)

    @property
    def valence(self) -> np.ndarray:
        """(V,) int64 number of neighbours."""
        return np.diff(self.indptr)


def edge_graph(faces: np.ndarray, vertices: int) -> EdgeGraph:
    """Neighbourhoods of the vertices of faces (F, 3); `vertices` is how many there are."""
    pairs, _ = mesh_edges(faces, vertices)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    keys = np.sort(both[:, 0] * vertices + both[:, 1])
    indptr = np.zeros(vertices + 1, np.int64)
    np.cumsum(np.bincount(keys // max(vertices, 1), minlength=vertices), out=indptr[1:])
    return EdgeGraph(indptr, keys % max(vertices, 1))


def mesh_edges(faces: np.ndarray, vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """Undirected edges of faces (F, 3); `vertices` is the number of vertices.

    Returns:
        (E, 2) int64 vertex pairs, ascending in each pair and lexicographically, and (E,) the number of face
        sides along each. Sides from a vertex to itself are left out.
    """
    keys = _side_keys(faces, vertices)
    keys = np.sort(keys[keys >= 0])
    first = np.flatnonzero(np.diff(keys, prepend=-1))
    return _pairs(keys[first], vertices), np.diff(first, append=len(keys))


def face_edges(faces: np.ndarray, vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """Edges by face, for faces without repeated vertices.

    Returns:
        (E, 2) int64 vertex pairs as `mesh_edges` gives them, and (F, 3) int64 the edge between the corners k
        and k + 1 of every face.
    """
    keys = _side_keys(faces, vertices)
    order = np.argsort(keys, kind="stable")
    new = np.diff(keys[order], prepend=-1) > 0
    sides = np.empty(len(keys), np.int64)
    sides[order] = np.cumsum(new) - 1
    return _pairs(keys[order][new], vertices), sides.reshape(-1, 3)


def paired_sides(faces: np.ndarray, vertices: int) -> np.ndarray:
    """(P, 2) int64 the sides of those edges that exactly two faces share, in the order of `face_edges`.

    Side 3 f + k of faces (F, 3) runs from the corner k of face f to the next one; the lower number is first.
    """
    pairs, edges = face_edges(faces, vertices)
    order = np.argsort(edges.ravel(), kind="stable")
    count = np.bincount(edges.ravel(), minlength=len(pairs))
    first = (np.cumsum(count) - count)[count == 2]
    return np.stack([order[first], order[first + 1]], axis=1)


def _side_keys(faces: np.ndarray, vertices: int) -> np.ndarray:
    """(3 F,) one number per undirected edge for every face side, -1 for sides from a vertex to itself."""
    a = faces.astype(np.int64).ravel()
    b = np.roll(faces, -1, axis=1).astype(np.int64).ravel()
    return np.where(a == b, -1, np.minimum(a, b) * vertices + np.maximum(a, b))


def _pairs(keys: np.ndarray, vertices: int) -> np.ndarray:
    return np.stack(np.divmod(keys, max(vertices, 1)), axis=1)


def components(edges: EdgeGraph) -> tuple[int, np.ndarray]:
    """Number of connected components, and (V,) int32 which one each vertex belongs to."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    size = len(edges.indptr) - 1
    matrix = csr_array((np.ones(len(edges.indices), np.int8), edges.indices, edges.indptr), (size, size))
    return connected_components(matrix, directed=False)


def boundary_edges(faces: np.ndarray, vertices: int) -> np.ndarray:
    """(B, 2) int64 vertex pairs of the edges that belong to one face only."""
    pairs, counts = mesh_edges(faces, vertices)
    return pairs[counts == 1]


def non_manifold_edges(faces: np.ndarray, vertices: int) -> np.ndarray:
    """(N, 2) int64 vertex pairs of the edges that belong to more than two faces."""
    pairs, counts = mesh_edges(faces, vertices)
    return pairs[counts > 2]


def opposed_edges(faces: np.ndarray, vertices: int) -> int:
    """Number of edges of two faces that run along it in the same direction: their windings disagree."""
    one, other = faces.ravel()[paired_sides(faces, vertices)].T
    return int((one == other).sum())


def euler_characteristic(faces: np.ndarray, vertices: int) -> int:
    """V - E + F."""
    return vertices - len(mesh_edges(faces, vertices)[0]) + len(faces)


def boundary_loops(faces: np.ndarray, vertices: int) -> int:
    """Number of connected pieces of the boundary."""
    pairs = boundary_edges(faces, vertices)
    if not len(pairs):
        return 0
    _, index = np.unique(pairs, return_inverse=True)
    index = index.reshape(pairs.shape)
    # An edge as a face that goes back to its start has no other neighbours than its two ends.
    return components(edge_graph(np.column_stack([index, index[:, 0]]), int(index.max()) + 1))[0]


def welded(vertices: np.ndarray) -> np.ndarray:
    """(V,) int64, the same number for equal rows (V, k), as of vertices at one position; ascending from 0.

    0 equals -0.
    """
    order = np.lexsort(vertices.T)
    ordered = vertices[order]
    number = np.empty(len(order), np.int64)
    number[order] = np.cumsum(np.r_[False, (ordered[1:] != ordered[:-1]).any(axis=1)][: len(order)])
    return number
