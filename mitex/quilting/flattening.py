"""The surroundings of a point laid flat along a direction field, so that a patch of a texture fits on them.

Coordinates x and y are wanted whose gradients are the field's right and up. No surface with curvature has
such, so the nearest in least squares are taken: Poisson's equation with the field as its guide, on the faces
around the point. Patches at neighbouring points are then turned alike, whatever charts the mesh is cut into.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

from mitex.geometry.triangles import triangle_crosses
from mitex.geometry.vectors import dot, orthonormal, unit_normals
from mitex.mesh import Mesh
from mitex.mesh.connection import solver
from mitex.mesh.frames import interpolate_frames
from mitex.mesh.matrices import edge_lengths
from mitex.mesh.topology import welded

STRETCH = 1.6  # the largest factor by which lengths may change, up or down
TORN = 0.25  # sides of faces whose ends were reached on ways so far apart are cut [reach]
PARTS = (1.0, 0.5, 0.25, 0.12, 0.06)  # of the reach; the next one is tried where the surface bends too much
ROUND = 0.3  # faces so near to the point have to fit [reach]
LEAST = 1e-12  # area of a face, at least, relative to the largest
PIN = 1e-9  # holds the constant of a solution, relative to the mean diagonal


@dataclass(frozen=True, eq=False)
class _Surroundings:
    """The faces around a face.

    Attributes:
        face: in the middle.
        faces: (N,) ascending, all within reach, among them `face`.
        away: (V,) how far the vertices are from its corners along edges, infinite beyond reach.
        previous: (V,) the vertex before on the shortest way, negative where there is none.
        reach: [mesh units].
    """

    face: int
    faces: np.ndarray
    away: np.ndarray
    previous: np.ndarray
    reach: float

    def within(self, reach: float, corners: np.ndarray) -> _Surroundings:
        """Those of the faces, whose corners are (F, 3), that are nearer."""
        near = (self.away[corners[self.faces]] <= reach).all(1)
        return replace(self, faces=self.faces[near])


class Flattening:
    """Lays a surface flat around any of its points.

    Faces are connected where corners are at one place. A side of several faces is passed to all of them.

    Args:
        mesh: F faces, small beside `reach`.
        directions: (V, 3) where the texture's right shall point at the vertices.
        reach: how far from the point faces are laid flat [mesh units].
    """

    def __init__(self, mesh: Mesh, directions: np.ndarray, reach: float) -> None:
        self.reach = reach
        self.points = mesh.vertices[mesh.faces].astype(np.float64)
        vertex = welded(mesh.vertices)
        self.corners, self.count = vertex[mesh.faces], int(vertex.max()) + 1
        centre = np.full((len(mesh.faces), 3), 1 / 3)
        self.right, self.up = interpolate_frames(mesh, np.arange(len(mesh.faces)), centre, directions)
        crosses = triangle_crosses(self.points)
        self.normals, twice = unit_normals(crosses), np.linalg.norm(crosses, axis=1)
        solid = twice > LEAST * twice.max()
        self.areas = np.where(solid, 0.5 * twice, 0.0)
        sides = np.roll(self.points, 1, axis=1) - np.roll(self.points, -1, axis=1)
        hats = np.cross(self.normals[:, None], sides) / np.where(solid, twice, 1.0)[:, None, None]
        # (F, 3, 3) gradients of the functions that are 1 at one corner and 0 at the others.
        self.hats = np.where(solid[:, None, None], hats, 0.0)
        self.around = _vertex_faces(self.corners, self.count)
        positions = np.empty((self.count, 3))
        positions[vertex] = mesh.vertices
        self.graph = edge_lengths(self.corners, positions)

    def distances(self) -> np.ndarray:
        """(F,) of the faces from the first face of their connected part, along edges [mesh units]."""
        _, part = connected_components(self.graph, directed=False)
        _, first = np.unique(part[self.corners[:, 0]], return_index=True)
        away = dijkstra(self.graph, indices=self.corners[first, 0], min_only=True)
        return away[self.corners].mean(axis=1)

    def __call__(
        self, face: int, barycentric: np.ndarray, size: float = 1.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """The faces around a point in the plane, without those that do not fit in.

        Args:
            face: that the point lies on.
            barycentric: (3,) where on it.
            size: factor of the reach.

        Returns:
            (K,) faces, among them `face`, and (K, 3, 2) where their corners are, x to the right and y up, the
            point at 0 [mesh units].
        """
        reach = size * self.reach
        whole = self._surroundings(face, reach)
        result = np.zeros(0, np.int64), np.zeros((0, 3, 2))
        for part in PARTS:
            around = whole.within(part * reach, self.corners)
            faces = around.faces
            corners_away = around.away[self.corners[faces]]
            close = (corners_away < ROUND * part * reach).all(1) & (self.areas[faces] > 0)
            field = self.right[faces]
            along = orthonormal(np.broadcast_to(self.right[face], field.shape), self.normals[faces])
            ahead = dot(along, field) > 0  # the others would be laid upside down, as beyond a rim
            for right, wanted in ((field, np.ones_like(ahead)), (along, ahead)):
                other = self._mapped(around, right, wanted)
                result = max(result, other, key=lambda r: self.areas[r[0]].sum())
                if np.isin(faces[close & wanted], other[0]).all():
                    return self._around_the_point(face, barycentric, *other)
        return self._around_the_point(face, barycentric, *result)

    def turns(self, faces: np.ndarray, flat: np.ndarray) -> np.ndarray:
        """(K,) [rad] from the field's right to the plane's on faces (K,) whose corners (K, 3, 2) are there.

        Counter-clockwise, seen from outside.
        """
        axes = self._axes(faces, self.right[faces])
        (a, b), (c, d) = self._jacobians(faces, flat, axes).transpose(1, 2, 0)
        return np.arctan2(b - c, a + d)

    def _surroundings(self, face: int, reach: float) -> _Surroundings:
        away, previous, _ = dijkstra(
            self.graph,
            indices=np.unique(self.corners[face]),
            min_only=True,
            limit=reach,
            return_predecessors=True,
        )
        near = np.isfinite(away)
        faces = np.unique(np.concatenate([self.around[vertex] for vertex in np.flatnonzero(near)]))
        return _Surroundings(face, faces[near[self.corners[faces]].all(1)], away, previous, reach)

    def _mapped(
        self, around: _Surroundings, right: np.ndarray, wanted: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Those of the N faces that fit into the plane, and their corners there, (K,) and (K, 3, 2).

        Args:
            around: the faces.
            right: (N, 3) where the texture's right shall point on them.
            wanted: (N,) bool, which of them to take.
        """
        axes = self._axes(around.faces, right)
        points = self.points[around.faces]
        whole = wanted & ~self._torn(around, (np.roll(points, -1, axis=1) - points) @ axes)
        faces, axes = around.faces[whole], axes[whole]
        used, corners = np.unique(self.corners[faces], return_inverse=True)
        corners = corners.reshape(-1, 3)
        hats, areas = self.hats[faces], self.areas[faces]
        stiffness = areas[:, None, None] * (hats @ hats.swapaxes(1, 2))
        load = areas[:, None, None] * (hats @ axes)
        flat = _solution(corners, stiffness, load, len(used))[corners]
        fits = _fits(self._jacobians(faces, flat, axes)) & (areas > 0)
        fits &= _connected(corners, fits, int(faces.searchsorted(around.face)))
        return faces[fits], flat[fits]

    def _axes(self, faces: np.ndarray, right: np.ndarray) -> np.ndarray:
        """(N, 3, 2) right (N, 3) and up on the faces."""
        return np.stack([right, np.cross(self.normals[faces], right)], axis=2)

    def _jacobians(self, faces: np.ndarray, flat: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """(N, 2, 2) of the plane's coordinates (N, 3, 2) at corners, by those along the axes (N, 3, 2)."""
        return np.einsum("fka,fkb->fab", flat, self.hats[faces] @ axes)

    def _torn(self, around: _Surroundings, steps: np.ndarray) -> np.ndarray:
        """(N,) bool, which faces lie where ways around both sides of something meet.

        The field is followed along the shortest way to each vertex; where the ends of a side come out
        elsewhere than the field between them says, the surface is cut, as on the far side of a tube.

        Args:
            around: the faces.
            steps: (N, 3, 2) what their sides are in the field.
        """
        used, corners = np.unique(self.corners[around.faces], return_inverse=True)
        start = corners.reshape(-1, 3)
        end = np.roll(start, -1, axis=1)
        own, last = np.arange(len(used)), around.previous[used]
        before = np.minimum(np.searchsorted(used, last), len(used) - 1)
        before = np.where(used[before] == last, before, own)  # ways begin where nothing is before
        way = np.zeros((len(used), 2))
        for tail, head, sign in ((start, end, 1.0), (end, start, -1.0)):
            taken = (before[head] == tail) & (before[head] != head)
            way[head[taken]] = sign * steps[taken]
        # What is known of the ways doubles with each round.
        while (before[before] != before).any():
            way += way[before]
            before = before[before]
        own_face = around.faces.searchsorted(around.face)
        origin = np.zeros((len(used), 2))
        origin[start[own_face, 1:]] = np.cumsum(steps[own_face, :2], axis=0)
        way += origin[before]
        jumps = np.linalg.norm(way[end] - way[start] - steps, axis=2)
        return (jumps > TORN * around.reach).any(1) & (around.faces != around.face)

    def _around_the_point(
        self, face: int, barycentric: np.ndarray, faces: np.ndarray, flat: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The map with the point at 0; the point's own face as it is, if it did not fit."""
        own = np.flatnonzero(faces == face)
        if not len(own):
            axes = np.stack([self.right[face], self.up[face]], axis=1)
            faces, flat = np.array([face]), (self.points[face] @ axes)[None]
            own = [0]
        return faces, flat - barycentric @ flat[own[0]]


def _fits(jacobians: np.ndarray) -> np.ndarray:
    """(N,) bool, which of (N, 2, 2) neither mirror nor stretch by more than `STRETCH`."""
    (a, b), (c, d) = jacobians.transpose(1, 2, 0)
    area, squares = a * d - b * c, a * a + b * b + c * c + d * d  # product and squared sum of the stretches
    total, difference = np.sqrt(np.maximum(squares + 2 * np.stack([area, -area]), 0.0))
    return (area > 0) & (total + difference < 2 * STRETCH) & (total - difference > 2 / STRETCH)


def _vertex_faces(corners: np.ndarray, count: int) -> list[np.ndarray]:
    """The faces around each vertex."""
    order = np.argsort(corners.ravel(), kind="stable") // 3
    ends = np.cumsum(np.bincount(corners.ravel(), minlength=count))
    return np.split(order, ends[:-1])


def _solution(corners: np.ndarray, stiffness: np.ndarray, load: np.ndarray, count: int) -> np.ndarray:
    """(count, 2) values at the vertices whose gradients are nearest to the field.

    Args:
        corners: (N, 3) of the faces.
        stiffness: (N, 3, 3), and
        load: (N, 3, 2) of their corners.
    """
    rows = np.broadcast_to(corners[:, :, None], stiffness.shape).ravel()
    columns = np.broadcast_to(corners[:, None], stiffness.shape).ravel()
    own = np.arange(count)
    pin = PIN * stiffness.trace(axis1=1, axis2=2).mean()
    entries = np.concatenate([stiffness.ravel(), np.full(count, max(pin, np.finfo(np.float64).tiny))])
    indices = np.concatenate([rows, own]), np.concatenate([columns, own])
    solve = solver(coo_array((entries, indices), shape=(count,) * 2).tocsc())
    sums = [np.bincount(corners.ravel(), load[..., k].ravel(), count) for k in (0, 1)]
    return np.stack([solve(total) for total in sums], axis=1)


def _connected(corners: np.ndarray, used: np.ndarray, start: int) -> np.ndarray:
    """(N,) bool, which of the `used` faces are connected with the face `start` by such faces."""
    if not used[start]:
        return np.zeros(len(corners), bool)
    links = corners[used]
    pairs = np.concatenate([links[:, :2], links[:, 1:]])
    count = int(corners.max()) + 1
    graph = coo_array((np.ones(len(pairs), bool), tuple(pairs.T)), shape=(count,) * 2)
    part = connected_components(graph, directed=False)[1]
    return part[corners[:, 0]] == part[corners[start, 0]]
