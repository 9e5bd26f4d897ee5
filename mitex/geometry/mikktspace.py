"""Tangents as MikkTSpace defines them, which Blender, Unity, Unreal and others compute for a mesh.

M. S. Mikkelsen, "Simulation of wrinkled surfaces revisited" (2008), and the behaviour of the public
implementations. A normal map is an encoding: only a reader with the same tangents decodes it, so the rules
must be kept:

- Corners of equal position, normal and UV are one vertex, whatever the mesh's indices say.
- The corners around a vertex fall into fans: those of triangles that share edges (both ends equal, opposite
  directions) and whose UVs have the same orientation.
- A fan's tangent is the sum of its triangles' tangents dp/du, each projected onto the plane across the
  vertex normal, normalised, and weighted by the triangle's angle in that plane.
- Triangles without UV area contribute nothing, and join the fan that reaches them first. Triangles of which
  two corners coincide take the tangents of the first proper triangle at the same vertex.

One rule is left out, as rounding decides it: implementations keep triangles of a fan apart whose tangents are
opposite to the last bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mitex.geometry.vectors import across, cross_2d, scatter_add, unit

DEFAULT = (1.0, 0.0, 0.0)  # the tangent where no UVs give one; its sign is -1


class CornerTangents(NamedTuple):
    """Tangents of the corners of F triangles.

    Attributes:
        vectors: (F, 3, 3) float64, unit and across the normal; `DEFAULT` where the UVs have no area.
        signs: (F, 3) float64, the bitangent is sign * cross(normal, tangent); -1 in mirrored layouts.
        fans: (F, 3) int64, corners of the same number have the same tangent.
    """

    vectors: np.ndarray
    signs: np.ndarray
    fans: np.ndarray


class _Faces(NamedTuple):
    """What triangles know by themselves.

    Attributes:
        tangents: (F, 3) unit dp/du.
        preserving: (F,) whether the UVs run around as the surface does.
        flat: (F,) whether the UVs have no area.
        collapsed: (F,) whether corners coincide.
    """

    tangents: np.ndarray
    preserving: np.ndarray
    flat: np.ndarray
    collapsed: np.ndarray


def corner_tangents(
    vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray, uv: np.ndarray
) -> CornerTangents:
    """The tangents of a mesh.

    Args:
        vertices: (V, 3) float32.
        normals: (V, 3) float32, unit; vertices at hard edges are there once for each normal.
        faces: (F, 3) into the vertices.
        uv: (F, 3, 2) float32, v upwards.
    """
    corners = _welded(vertices, normals, faces, uv)
    triangles = _triangles(vertices[faces], uv)
    partners = _partners(corners, ~triangles.collapsed)
    _orient_flat(triangles, corners, partners)
    fans = _fans(triangles.preserving, partners)
    vectors, defined = _summed(triangles, vertices[faces], normals[faces], fans)
    preserving = np.repeat(triangles.preserving, 3)
    _adopt(triangles.collapsed, corners, vectors, defined, preserving, fans)
    signs = np.where(defined & preserving, 1.0, -1.0)
    vectors[~defined] = DEFAULT
    return CornerTangents(vectors.reshape(-1, 3, 3), signs.reshape(-1, 3), fans.reshape(-1, 3))


def _welded(vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(F, 3) the same number for corners of equal position, normal and UV."""
    places = numbered(_bits(np.concatenate([vertices, normals], axis=1)))
    return numbered([places[faces].ravel(), *_bits(uv.reshape(-1, 2))]).reshape(-1, 3)


def _bits(values: np.ndarray) -> list[np.ndarray]:
    """The bits of (N, 2 k) floats as k columns of int64; -0.0 is 0.0."""
    columns = np.ascontiguousarray(values.astype(np.float32) + np.float32(0.0)).view(np.int64)
    return list(columns.T)


def numbered(columns: list[np.ndarray]) -> np.ndarray:
    """(N,) the same number, from 0, for equal rows; they are in order of the last column first."""
    order = np.lexsort(columns)
    changes = np.zeros(len(order) - 1, bool)
    for column in columns:
        changes |= np.diff(column[order]) != 0
    numbers = np.empty(len(order), np.int64)
    numbers[order] = np.concatenate([[0], np.cumsum(changes)])
    return numbers


def _triangles(points: np.ndarray, uv: np.ndarray) -> _Faces:
    """Of triangles with corners (F, 3, 3) and UVs (F, 3, 2)."""
    edges = uv.astype(np.float32)
    edges = edges[:, 1:] - edges[:, :1]
    # In single precision like the others, so that thin triangles get the same orientation.
    area = cross_2d(edges[:, 0], edges[:, 1])
    p = points.astype(np.float64)
    first, second = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    rise, run = edges[:, ::-1, 1, None].astype(np.float64), edges[:, ::-1, 0, None].astype(np.float64)
    along_u = rise[:, 0] * first - rise[:, 1] * second
    along_v = run[:, 1] * second - run[:, 0] * first
    lengths = np.linalg.norm([along_u, along_v], axis=2)
    flat = (np.abs(area) <= np.finfo(np.float32).tiny) | (lengths == 0).any(axis=0)
    preserving = area > 0
    tangents = unit(along_u * np.where(preserving, 1.0, -1.0)[:, None])
    collapsed = (points == np.roll(points, 1, axis=1)).all(axis=2).any(axis=1)
    return _Faces(tangents, preserving, flat, collapsed)


def _partners(corners: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """(3 F,) the half-edge on the other side of each half-edge, -1 where there is none.

    Half-edge 3 f + k runs from corner k of triangle f to the next. Where more than two meet, each is paired
    with the first later one of opposite direction.
    """
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    half_edges = np.flatnonzero(np.repeat(usable, 3))
    low, high = np.minimum(start, end)[half_edges], np.maximum(start, end)[half_edges]
    key = low * (corners.max(initial=0) + 1) + high
    order = np.argsort(key, kind="stable")
    half_edges, key = half_edges[order], key[order]
    first = np.flatnonzero(np.diff(key, prepend=-1))
    count = np.diff(first, append=len(key))
    partners = np.full(3 * len(corners), -1)
    a, b = half_edges[first[count == 2]], half_edges[first[count == 2] + 1]
    opposite = start[a] == end[b]
    partners[a[opposite]], partners[b[opposite]] = b[opposite], a[opposite]
    for k in np.flatnonzero(count > 2):
        _pair(half_edges[first[k] : first[k] + count[k]].tolist(), start, partners)
    return partners


def _pair(half_edges: list[int], start: np.ndarray, partners: np.ndarray) -> None:
    """Pairs the half-edges between two vertices."""
    for k, a in enumerate(half_edges):
        later = (b for b in half_edges[k + 1 :] if partners[b] < 0 and start[a] != start[b])
        if partners[a] < 0 and (b := next(later, -1)) >= 0:
            partners[a], partners[b] = b, a


def _next(half_edges: np.ndarray) -> np.ndarray:
    return half_edges + 1 - 3 * (half_edges % 3 == 2)


def _orient_flat(triangles: _Faces, corners: np.ndarray, partners: np.ndarray) -> None:
    """Gives triangles without UV area the orientation of the first fan that reaches them, in place.

    Fans are visited in the order of their first corners; only those at vertices of such triangles matter.
    """
    open_faces = triangles.flat & ~triangles.collapsed
    near = np.isin(corners, corners[open_faces]) & ~(triangles.flat | triangles.collapsed)[:, None]
    preserving, visited = triangles.preserving, set()
    for seed in np.flatnonzero(near.ravel()).tolist():
        stack = [seed]
        while stack:
            corner = stack.pop()
            face = corner // 3
            if open_faces[face]:
                preserving[face], open_faces[face] = preserving[seed // 3], False
            if corner in visited or preserving[face] != preserving[seed // 3]:
                continue
            visited.add(corner)
            left, right = partners[corner], partners[3 * face + (corner + 2 - 3 * face) % 3]
            stack += [int(_next(left))] if left >= 0 else []
            stack += [int(right)] if right >= 0 else []


def _fans(preserving: np.ndarray, partners: np.ndarray) -> np.ndarray:
    """(3 F,) the number of each corner's fan."""
    half_edges = np.flatnonzero(partners >= 0)
    others = partners[half_edges]
    same = preserving[half_edges // 3] == preserving[others // 3]
    pairs = half_edges[same], _next(others[same])  # where one starts, the other ends
    graph = coo_array((np.ones(len(pairs[0]), np.int8), pairs), shape=(len(partners), len(partners)))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _summed(
    triangles: _Faces, points: np.ndarray, normals: np.ndarray, fans: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(3 F, 3) each fan's tangent, and (3 F,) whether any triangle gave it one."""
    n, p = normals.astype(np.float64), points.astype(np.float64)
    ahead = unit(across(np.roll(p, -1, axis=1) - p, n))
    behind = unit(across(np.roll(p, 1, axis=1) - p, n))
    angle = np.arccos(np.clip((ahead * behind).sum(axis=2), -1.0, 1.0))
    tangents = unit(across(triangles.tangents[:, None], n)) * angle[..., None]
    regular = np.repeat(~(triangles.flat | triangles.collapsed), 3)
    tangents, fan = tangents.reshape(-1, 3)[regular], fans[regular]
    count = int(fans.max(initial=0)) + 1
    return unit(scatter_add(fan, tangents, count))[fans], (np.bincount(fan, minlength=count) > 0)[fans]


def _adopt(
    collapsed: np.ndarray,
    corners: np.ndarray,
    vectors: np.ndarray,
    defined: np.ndarray,
    preserving: np.ndarray,
    fans: np.ndarray,
) -> None:
    """Gives the corners of collapsed triangles what the first proper one at the vertex has, in place."""
    proper, lost = np.flatnonzero(np.repeat(~collapsed, 3)), np.flatnonzero(np.repeat(collapsed, 3))
    first = np.full(corners.max(initial=0) + 1, -1)
    first[corners.ravel()[proper[::-1]]] = proper[::-1]
    source = first[corners.ravel()[lost]]
    lost, source = lost[source >= 0], source[source >= 0]
    for values in (vectors, defined, preserving, fans):
        values[lost] = values[source]
