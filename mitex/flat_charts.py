"""Charts of meshes with very many faces: connected parts that look along one axis, projected along it.

Flattening charts, as xatlas does, takes time that grows with the square of their faces. Projecting them takes
linear time. Faces that look between three axes are then shown 1.7 times smaller than others.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from mitex.charts import Packing, packed_charts
from mitex.geometry.raster import covered_texels
from mitex.geometry.vectors import scatter_add
from mitex.mesh import Mesh

SMOOTHINGS = 8  # rounds over the neighbours before faces are sorted by the direction that they look in
STEEPEST = 0.25  # cosine between a face's normal and its axis, below which it takes an axis of its own
OVERLAP = 1e-3  # share of a chart's texels that may be covered twice
GRID = 1024  # side of the raster that overlaps are looked for on [texels]
PLANES = np.array([(1, 2), (0, 2), (0, 1)])  # coordinates that are left when one is projected away


def sides(mesh: Mesh) -> np.ndarray:
    """Which way each face looks (F,): 0 to 5 for -x, +x, -y, +y, -z, +z, once normals have been smoothed."""
    normals = mesh.normals
    for _ in range(SMOOTHINGS):
        normals = normals + scatter_add(mesh.edges.rows, normals[mesh.edges.indices], len(normals))
    return _along(normals[mesh.faces].sum(1))


def projected_charts(mesh: Mesh, packing: Packing) -> tuple[np.ndarray, np.ndarray]:
    """Charts without overlaps, packed side by side: those that overlap themselves are halved until none does.

    Args:
        mesh: any mesh.
        packing: how they are packed.

    Returns:
        (F, 3, 2) float32 coordinates of the corners in [0, 1], and the chart of each face (F,).

    Raises:
        MeshError: as `packed_charts`.
    """
    side = _own_where_steep(mesh, sides(mesh))
    axis, pairs = side // 2, _neighbours(mesh)
    corners = mesh.vertices[mesh.faces]
    flat = np.take_along_axis(corners, PLANES[axis][:, None, :], axis=2)
    depth = np.take_along_axis(corners.mean(1), axis[:, None], axis=1)[:, 0]
    rank = depth.argsort(kind="stable").argsort()  # unlike depths, no two are equal: each cut parts faces
    charts = _connected(side, pairs)
    while True:
        uv = _packed(mesh, flat, charts, packing)
        cut = _overlapping(uv, charts) & (np.bincount(charts) > 1)
        if not cut.any():
            return uv, charts
        upper = rank > _means(charts, rank)[charts]
        charts = _connected(2 * charts + (cut[charts] & upper), pairs)


def _own_where_steep(mesh: Mesh, side: np.ndarray) -> np.ndarray:
    """The sides, but for faces that are turned too far from theirs: those of their own normals."""
    sign = 2 * (side % 2) - 1
    cosine = sign * np.take_along_axis(mesh.face_normals, side[:, None] // 2, axis=1)[:, 0]
    return np.where(cosine < STEEPEST, _along(mesh.face_normals), side)


def _along(vectors: np.ndarray) -> np.ndarray:
    axis = np.abs(vectors).argmax(1)
    return 2 * axis + (np.take_along_axis(vectors, axis[:, None], 1)[:, 0] > 0)


def _neighbours(mesh: Mesh) -> np.ndarray:
    """Pairs of faces that share an edge (N, 2)."""
    ends = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2).astype(np.int64)
    keys, faces = ends[:, 0] * len(mesh.vertices) + ends[:, 1], np.repeat(np.arange(len(mesh.faces)), 3)
    order = np.argsort(keys, kind="stable")
    shared = np.flatnonzero(np.diff(keys[order]) == 0)
    return np.stack((faces[order[shared]], faces[order[shared + 1]]), axis=1)


def _connected(group: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """The connected part of its group that each face is in (F,)."""
    first, second = pairs[group[pairs[:, 0]] == group[pairs[:, 1]]].T
    graph = coo_matrix((np.ones(len(first), bool), (first, second)), shape=(len(group), len(group)))
    return connected_components(graph, directed=False)[1]


def _packed(mesh: Mesh, flat: np.ndarray, charts: np.ndarray, packing: Packing) -> np.ndarray:
    """Corners (F, 3, 2) in [0, 1] of charts, put apart first: xatlas takes vertices at one place for one."""
    low = np.full((charts.max() + 1, 2), np.inf)
    np.minimum.at(low, charts, flat.min(1))
    columns = int(np.ceil(np.sqrt(len(low))))
    pitch = 1.1 * float(np.ptp(mesh.vertices, axis=0).max())
    places = pitch * np.stack(np.divmod(np.arange(len(low)), columns), axis=1)
    apart = flat - (low - places)[charts][:, None, :]
    keys = charts[:, None].astype(np.int64) * len(mesh.vertices) + mesh.faces
    _, first, corner = np.unique(keys, return_index=True, return_inverse=True)
    part = (apart.reshape(-1, 2)[first], corner.reshape(-1, 3))
    return packed_charts([part], packing, mesh.name)[0]


def _overlapping(uv: np.ndarray, charts: np.ndarray) -> np.ndarray:
    """Which charts cover too many texels twice."""
    texels, faces = [], []
    for face, texel, barycentric in covered_texels(uv, GRID):
        inside = barycentric.min(axis=1) > 1e-3
        texels.append(texel[inside])
        faces.append(face[inside])
    texel, chart = np.concatenate(texels), charts[np.concatenate(faces)]
    count = charts.max() + 1
    twice = np.bincount(texel, minlength=GRID * GRID)[texel] > 1
    covered = np.bincount(chart, minlength=count)
    return np.bincount(chart[twice], minlength=count) > OVERLAP * np.maximum(covered, 1)


def _means(charts: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.bincount(charts, values) / np.bincount(charts)
