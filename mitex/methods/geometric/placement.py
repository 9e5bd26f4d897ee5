"""Bumps and dents for the first generator to start from, spread as densely as on the reference.

Where a knob or a crater takes many faces of a level, lower generators put it in its place, on the template.
Growth on other meshes starts above these (Hertz et al. 2020, section 4, "Hierarchical generation"), so that
nothing says where one ends and the next begins: knobs flow together. So the reference, as the first generator
leaves it, is asked how many faces there are for each bump and how high it is, and the mesh gets bumps like
these, evenly spread.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from mitex.mesh import Mesh
from mitex.mesh.connection import solver
from mitex.mesh.matrices import edge_lengths, ring_means

REACH = 3.0  # of the smoothing that tells bumps from the shape [edges]
TOP = 0.97  # quantile of the heights that counts as the top; half of it divides bumps from the ground
FEWEST = 8  # bumps or dents that make a texture
LARGEST = 0.1  # share of what is raised that one bump may have: winding ridges are no bumps
SHARE_UP, SHARE_DOWN = 0.6, 0.4  # of the height that bumps, or dents, get: generators add to it
WIDEST = 40  # faces for each bump: larger ones are more than a vertex that is raised
LOWEST = 0.5  # height of a bump [edges]; what is lower the first generator makes by itself


class Bumps(NamedTuple):
    """How bumps cover a surface.

    Attributes:
        faces: for each of them, on average.
        height: of one above the ground [edges]; below 0 for dents.
    """

    faces: float
    height: float


def bumps(mesh: Mesh, edge: float) -> Bumps | None:
    """The bumps or dents of a surface; None if it has no separate ones.

    Args:
        mesh: a coarse mesh whose bumps are a few vertices wide.
        edge: the length in which heights are measured [mesh units].
    """
    heights = _heights(mesh) / edge
    side = 1.0 if np.mean((heights - heights.mean()) ** 3) > 0 else -1.0  # a minority is up, or down
    tops = separate_tops(mesh, side * heights)
    if tops is None:
        return None
    faces = len(mesh.faces) / len(tops)
    height = float(np.median([(side * heights)[top].max() for top in tops]))
    return Bumps(faces, side * height) if faces <= WIDEST and height >= LOWEST else None


def separate_tops(mesh: Mesh, heights: np.ndarray) -> list[np.ndarray] | None:
    """The vertices of the upper half of each separate bump; None if bumps run together.

    Args:
        mesh: V vertices.
        heights: (V,) of these above the ground.
    """
    raised = np.flatnonzero(heights > 0.5 * np.quantile(heights, TOP))
    graph = edge_lengths(mesh.faces, mesh.vertices)[raised][:, raised]
    count, label = connected_components(graph, directed=False)
    if count < FEWEST or np.bincount(label).max() > LARGEST * len(raised):
        return None
    return [raised[label == k] for k in range(count)]


def placed(mesh: Mesh, texture: Bumps, seed: int) -> np.ndarray:
    """Vertices (V, 3) float64 of a mesh with bumps, each of which raises one vertex along its normal.

    Args:
        mesh: any mesh.
        texture: how many there shall be, and how high.
        seed: of the first one; each further one is farthest from all before along the edges.
    """
    vertices = mesh.vertices.astype(np.float64)
    edge = edge_lengths(mesh.faces, vertices).data.mean()
    where = even_places(mesh, texture.faces, seed)
    height = max(SHARE_UP * texture.height, 0) + min(SHARE_DOWN * texture.height, 0)
    vertices[where] += height * edge * mesh.normals[where]
    return vertices


def even_places(mesh: Mesh, faces: float, seed: int) -> np.ndarray:
    """Vertices of a mesh, evenly spread: one for so many faces, each farthest from those before."""
    used = np.unique(mesh.faces)
    graph = sparse.csr_array(edge_lengths(mesh.faces, mesh.vertices.astype(np.float64))[used][:, used])
    return used[_farthest(graph, min(round(len(mesh.faces) / faces), len(used)), seed)]


def _farthest(graph: sparse.csr_array, count: int, seed: int) -> np.ndarray:
    """Vertices (count,) of a graph, each farthest from those before (Gonzalez 1985).

    A vertex spreads only as far as no other is nearer (Dijkstra), so that late ones cost little.
    """
    first, ends = list(map(int, graph.indptr)), list(map(int, graph.indices))
    lengths = list(map(float, graph.data))
    away = np.full(len(first) - 1, np.inf)
    nodes, node = [], int(np.random.default_rng(seed).integers(len(away)))
    for _ in range(count):
        nodes.append(node)
        away[node], front = 0.0, [(0.0, node)]
        while front:
            distance, near = heappop(front)
            if distance > away[near]:
                continue
            for k in range(first[near], first[near + 1]):
                beyond = distance + lengths[k]
                if beyond < away[ends[k]]:
                    away[ends[k]] = beyond
                    heappush(front, (beyond, ends[k]))
        node = int(np.argmax(away))
    return np.array(nodes, np.int64)


def _heights(mesh: Mesh) -> np.ndarray:
    """(V,) of the vertices above the smoothed surface, along its normals; their median is 0."""
    weights = np.maximum(mesh.edges.valence, 1.0)[:, None]  # with which the matrix is symmetric
    mean = sparse.eye_array(len(weights)) * (1 + REACH**2) - REACH**2 * ring_means(mesh)
    smooth = solver((mean * weights).tocsc())(weights * mesh.vertices.astype(np.float64))
    surface = mesh.with_vertices(smooth)
    heights = ((mesh.vertices - smooth) * surface.normals).sum(1)
    return heights - np.median(heights)
