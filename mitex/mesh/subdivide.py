"""Subdivision: every triangle becomes four."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mitex.errors import MeshError
from mitex.geometry.vectors import scatter_add, unit
from mitex.mesh.mesh import Mesh
from mitex.mesh.topology import face_edges

MAX_FACES = 32_000_000

# From a mesh, its edges (E, 2) and the edges of its faces (F, 3) to the new positions (V + E, 3).
Rule = Callable[[Mesh, np.ndarray, np.ndarray], np.ndarray]


def subdivide_loop(mesh: Mesh, times: int = 1) -> Mesh:
    """Loop subdivision, which smooths: the limit is twice continuously differentiable but at odd valences.

    Rules of Loop (1987): an old vertex of valence n moves to (1 - n b) p + b sum of its neighbours,
    b = (5/8 - (3/8 + cos(2 pi / n) / 4)^2) / n; a new one is 3/8 of its edge's ends plus 1/8 of the two
    vertices opposite. Edges of one face, or more than two, are creases: midpoints, and (1/8, 3/4, 1/8) for
    the vertices along them; vertices where one crease ends or several meet stay.

    Args:
        mesh: any mesh.
        times: number of rounds.

    Returns:
        The old vertices come first, then one per edge in the order of `topology.mesh_edges`; face f becomes
        the faces 4 f to 4 f + 3. Corner UVs are halved linearly, so that seams stay where they are. Polygons
        are forgotten, corner normals too, as the surface becomes another.

    Raises:
        MeshError: `times` is negative, or the result would have more than 32 million faces.
    """
    return _repeat(mesh, times, _loop_points)


def subdivide_midpoint(mesh: Mesh, times: int = 1) -> Mesh:
    """Splits every edge in the middle; the shape stays as it is, and so do hard edges.

    Otherwise like `subdivide_loop`.
    """
    return _repeat(mesh, times, _midpoints)


def child_points(face: np.ndarray, barycentric: np.ndarray, times: int) -> tuple[np.ndarray, np.ndarray]:
    """Where points of a mesh are on the mesh that `subdivide_midpoint` makes of it in `times` rounds.

    Args:
        face: (P,) faces of the mesh.
        barycentric: (P, 3) on them; points a little outside stay outside.
        times: rounds.

    Returns:
        (P,) faces and (P, 3) barycentric coordinates on the subdivided mesh, in the types that were given.
    """
    for _ in range(times):
        corner = np.where(barycentric.max(axis=1) >= 0.5, barycentric.argmax(axis=1), 3)
        outer = 2 * barycentric - (np.arange(3) == corner[:, None])
        middle = 1 - 2 * np.roll(barycentric, 1, axis=1)
        barycentric = np.where(corner[:, None] == 3, middle, outer).astype(barycentric.dtype)
        face = (4 * face + corner).astype(face.dtype)
    return face, barycentric


def _repeat(mesh: Mesh, times: int, rule: Rule) -> Mesh:
    if times < 0:
        raise MeshError(f"a mesh cannot be subdivided {times} times", "use 0 or more")
    if len(mesh.faces) * 4**times > MAX_FACES:
        problem = f"{mesh.name} subdivided {times} times would have {len(mesh.faces) * 4**times:,} faces"
        raise MeshError(problem, f"stay below {MAX_FACES:,}")
    for _ in range(times):
        pairs, sides = face_edges(mesh.faces, len(mesh.vertices))
        points = rule(mesh, pairs, sides)
        middle = sides + len(mesh.vertices)
        uv = None
        if mesh.uv is not None:
            uv = _children(mesh.uv, 0.5 * (mesh.uv + np.roll(mesh.uv, -1, axis=1)))
        normals = _halved_normals(mesh) if rule is _midpoints else None
        mesh = Mesh(points, _children(mesh.faces, middle), uv, mesh.name, normals)
    return mesh


def _children(corner: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Per-corner values of the four children, (4 F, 3, ...), from those of corners and side middles."""
    c0, c1, c2 = corner[:, 0], corner[:, 1], corner[:, 2]
    s0, s1, s2 = side[:, 0], side[:, 1], side[:, 2]
    rows = [[c0, s0, s2], [s0, c1, s1], [s2, s1, c2], [s0, s1, s2]]
    children = np.stack([np.stack(row, axis=1) for row in rows], axis=1)
    return children.reshape(-1, *corner.shape[1:])


def _halved_normals(mesh: Mesh) -> np.ndarray | None:
    """(4 F, 3, 3) corner normals of the children: at the middle of a side the mean of its ends."""
    if mesh.corner_normals is None:
        return None
    total = mesh.corner_normals + np.roll(mesh.corner_normals, -1, axis=1)
    opposite = np.linalg.norm(total, axis=2, keepdims=True) < 1e-3
    return _children(mesh.corner_normals, unit(np.where(opposite, mesh.face_normals[:, None], total)))


def _midpoints(mesh: Mesh, pairs: np.ndarray, sides: np.ndarray) -> np.ndarray:
    old = mesh.vertices.astype(np.float64)
    return np.concatenate([old, 0.5 * (old[pairs[:, 0]] + old[pairs[:, 1]])])


def _loop_points(mesh: Mesh, pairs: np.ndarray, sides: np.ndarray) -> np.ndarray:
    old = mesh.vertices.astype(np.float64)
    count, edges = len(old), len(pairs)
    ends = old[pairs[:, 0]] + old[pairs[:, 1]]
    opposite = scatter_add(sides.ravel(), old[np.roll(mesh.faces, 1, axis=1).ravel()], edges)
    crease = np.bincount(sides.ravel(), minlength=edges) != 2
    new = np.where(crease[:, None], 0.5 * ends, 0.375 * ends + 0.125 * opposite)

    valence = np.bincount(pairs.ravel(), minlength=count)
    n = np.maximum(valence, 1)
    b = (0.625 - (0.375 + 0.25 * np.cos(2.0 * np.pi / n)) ** 2) / n
    smooth = (1.0 - valence * b)[:, None] * old + b[:, None] * _neighbour_sum(pairs, old)

    lines = pairs[crease]
    creases = np.bincount(lines.ravel(), minlength=count)[:, None]
    along = 0.75 * old + 0.125 * _neighbour_sum(lines, old)
    even = np.where(creases == 0, smooth, np.where(creases == 2, along, old))
    return np.concatenate([even, new])


def _neighbour_sum(pairs: np.ndarray, points: np.ndarray) -> np.ndarray:
    return scatter_add(pairs.ravel(), points[pairs[:, ::-1].ravel()], len(points))
