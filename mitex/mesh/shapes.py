"""Meshes by formula."""

from __future__ import annotations

import numpy as np

from mitex.errors import MeshError
from mitex.geometry.triangles import triangle_crosses
from mitex.geometry.vectors import dot, scatter_add, unit
from mitex.mesh.mesh import Mesh

RELAXATIONS = 4  # of scattered vertices


def icosphere(frequency: int) -> Mesh:
    """The unit sphere as a geodesic polyhedron: every icosahedron edge is cut into `frequency` equal arcs.

    Inside a face, the point with barycentric coordinates w lies along sum_k sin(w_k a) v_k, where a is the
    angle of an edge; that keeps the edges more even than projecting the flat grid (at frequency 64 their
    length varies by 5.1 % instead of 7.2 %, the longest is 1.18 instead of 1.47 times the shortest).

    Args:
        frequency: nu >= 1; 64 gives the 40,962 vertices of the MeshNCA paper, 32 gives 10,242.

    Returns:
        10 nu^2 + 2 vertices, 20 nu^2 faces; 12 vertices have valence 5, the others 6.

    Raises:
        MeshError: `frequency` is smaller than 1.
    """
    if frequency < 1:
        raise MeshError(f"an icosphere of frequency {frequency} is not possible", "use 1 or more")
    corners, base = _icosahedron()
    i, j = _triangle_grid(frequency)
    weights = np.stack([frequency - i - j, i, j], axis=1)
    ids = np.concatenate([_grid_ids(k, face, weights, frequency) for k, face in enumerate(base)])
    angle = np.arctan(2.0)
    points = np.einsum("gk,fkd->fgd", np.sin(weights * (angle / frequency)), corners[base])
    vertices = np.empty((10 * frequency**2 + 2, 3))
    vertices[ids] = (points / np.linalg.norm(points, axis=-1, keepdims=True)).reshape(-1, 3)
    small = _triangle_grid_faces(frequency)
    faces = ids.reshape(len(base), -1)[:, small].reshape(-1, 3)
    return Mesh(vertices, faces, name=f"icosphere{frequency}")


def scattered_sphere(count: int, seed: int = 0) -> Mesh:
    """The unit sphere with vertices at random places: edge lengths vary by 28 %, valences from 4 to 8.

    Uniform points, moved towards their neighbours four times, and their convex hull.

    Args:
        count: number of vertices, at least 4.
        seed: of the places.

    Returns:
        `count` vertices, 2 count - 4 faces.

    Raises:
        MeshError: there are too few vertices.
    """
    from scipy.spatial import ConvexHull

    if count < 4:
        raise MeshError(f"a sphere of {count} vertices is not possible", "use 4 or more")
    points = unit(np.random.default_rng(seed).normal(size=(count, 3)))
    for _ in range(RELAXATIONS):
        faces = ConvexHull(points).simplices
        around = scatter_add(faces.ravel(), points[np.roll(faces, 1, axis=1)].reshape(-1, 3), count)
        around += scatter_add(faces.ravel(), points[np.roll(faces, -1, axis=1)].reshape(-1, 3), count)
        points = unit(around)
    faces = ConvexHull(points).simplices
    inwards = dot(triangle_crosses(points[faces]), points[faces[:, 0]]) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return Mesh(points, faces, name=f"sphere{count}")


def torus(rings: int = 96, sides: int = 40, radius: float = 1.0, tube: float = 0.4) -> Mesh:
    """A torus around the y axis, made of rows of nearly equilateral triangles; every valence is 6.

    Args:
        rings: rows around the axis, even, at least 4.
        sides: vertices of each row, at least 3.
        radius: from the axis to the middle of the tube.
        tube: radius of the tube, smaller than `radius`.

    Raises:
        MeshError: a number is out of range.
    """
    if rings < 4 or rings % 2 or sides < 3:
        raise MeshError(
            f"a torus of {rings} rings and {sides} sides is not possible", "use 4, 6, 8, ... and 3 or more"
        )
    if not 0.0 < tube < radius:
        raise MeshError(f"a torus of radii {radius} and {tube} is not possible", "use 0 < tube < radius")
    row, column, faces = _staggered(rings, sides)
    around, across = row * (2.0 * np.pi / rings), column * (2.0 * np.pi / sides)
    reach = radius + tube * np.cos(across)
    points = [reach * np.sin(around), tube * np.sin(across), reach * np.cos(around)]
    return Mesh(np.stack(points, axis=1), faces, name="torus")


def grid(columns: int, rows: int) -> Mesh:
    """The square [-1, 1]^2 in the xy plane, facing +z, with UVs: columns x rows cells with a diagonal each.

    Raises:
        MeshError: fewer than one cell.
    """
    if min(columns, rows) < 1:
        raise MeshError(f"a grid of {columns} x {rows} cells is not possible", "use 1 or more")
    v, u = np.meshgrid(np.linspace(0.0, 1.0, rows + 1), np.linspace(0.0, 1.0, columns + 1), indexing="ij")
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    i, j = np.divmod(np.arange(rows * columns), columns)
    a = i * (columns + 1) + j
    b, c, d = a + 1, a + columns + 2, a + columns + 1
    faces = np.stack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)], axis=1).reshape(-1, 3)
    points = np.column_stack([2.0 * uv - 1.0, np.zeros(len(uv))])
    return Mesh(points, faces, uv[faces], name="grid")


def _staggered(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A closed lattice whose odd rows are shifted by half a column: vertex coordinates, and faces."""
    i, j = np.divmod(np.arange(rows * columns), columns)
    odd = i % 2

    def at(row: np.ndarray, column: np.ndarray) -> np.ndarray:
        return row % rows * columns + column % columns

    here, right = at(i, j), at(i, j + 1)
    flat = np.stack([here, right, at(i + 1, j + odd)], axis=1)
    peak = np.stack([at(i + 1, j), at(i + 1, j + 1), np.where(odd, here, right)], axis=1)
    faces = np.stack([flat[:, ::-1], peak], axis=1).reshape(-1, 3)
    return i.astype(float), j + 0.5 * odd, faces


def _icosahedron() -> tuple[np.ndarray, np.ndarray]:
    """Corners on the unit sphere, two of them at the poles (0, +-1, 0), and outward faces."""
    ring = np.arange(5) * (2.0 * np.pi / 5.0)
    height, radius = 1.0 / np.sqrt(5.0), 2.0 / np.sqrt(5.0)
    upper = np.stack([radius * np.sin(ring), np.full(5, height), radius * np.cos(ring)], axis=1)
    turned = ring + np.pi / 5.0
    lower = np.stack([radius * np.sin(turned), np.full(5, -height), radius * np.cos(turned)], axis=1)
    corners = np.concatenate([[[0.0, 1.0, 0.0]], upper, lower, [[0.0, -1.0, 0.0]]])
    k = np.arange(5)
    n = (k + 1) % 5
    top, bottom = np.zeros(5, int), np.full(5, 11)
    faces = np.concatenate(
        [
            np.stack([top, 1 + k, 1 + n], axis=1),
            np.stack([1 + k, 6 + k, 1 + n], axis=1),
            np.stack([1 + n, 6 + k, 6 + n], axis=1),
            np.stack([bottom, 6 + n, 6 + k], axis=1),
        ]
    )
    return corners, faces


def _triangle_grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (i, j) with i + j <= n, i slowest."""
    i, j = np.divmod(np.arange((n + 1) ** 2), n + 1)
    inside = i + j <= n
    return i[inside], j[inside]


def _triangle_grid_faces(n: int) -> np.ndarray:
    """(n^2, 3) indices into `_triangle_grid(n)`, oriented like its corners (0, 0), (n, 0), (0, n)."""

    def at(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        return i * (n + 1) - i * (i - 1) // 2 + j

    i, j = _triangle_grid(n - 1)
    up = np.stack([at(i, j), at(i + 1, j), at(i, j + 1)], axis=1)
    inner = i + j < n - 1
    i, j = i[inner], j[inner]
    down = np.stack([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], axis=1)
    return np.concatenate([up, down])


def _grid_ids(face_index: int, face: np.ndarray, weights: np.ndarray, n: int) -> np.ndarray:
    """Vertex numbers of one face's grid: 12 corners, then n - 1 per icosahedron edge, then the insides."""
    ids = np.empty(len(weights), np.int64)
    positive = weights > 0
    for k in range(3):
        ids[weights[:, k] == n] = face[k]
        a, b = sorted((int(face[k]), int(face[(k + 1) % 3])))
        side = positive[:, k] & positive[:, (k + 1) % 3] & ~positive[:, (k + 2) % 3]
        along = weights[side][:, k if face[k] == b else (k + 1) % 3]
        ids[side] = 12 + _EDGE_NUMBER[a, b] * (n - 1) + along - 1
    inner = positive.all(axis=1)
    ids[inner] = 12 + 30 * (n - 1) + face_index * inner.sum() + np.arange(inner.sum())
    return ids


_EDGE_NUMBER = {
    edge: number
    for number, edge in enumerate(
        sorted({tuple(sorted((int(f[k]), int(f[k - 1])))) for f in _icosahedron()[1] for k in range(3)})
    )
}
