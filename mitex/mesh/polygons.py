"""Polygons to triangles, and which polygons the triangles of a mesh were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mitex.errors import MeshError
from mitex.geometry.triangles import triangle_crosses

MAX_CORNERS = 2000


@dataclass(frozen=True, eq=False)
class Polygons:
    """The polygons that the F triangles of a mesh were cut from; each lies as one piece in the faces.

    Attributes:
        sizes: (P,) int64, their numbers of corners, 3 or more; polygon p was cut into sizes[p] - 2 triangles.
        triangles: (F, 3) int64, which polygon corner each triangle corner is, counted through all N of them.
        vertices: (N,) int64, the vertices that the polygons' corners have in the file, where it splits them
            at seams that the mesh has joined; None where they are the mesh's.

    Raises:
        MeshError: the arrays do not fit each other.
    """

    sizes: np.ndarray
    triangles: np.ndarray
    vertices: np.ndarray | None = None

    def __post_init__(self) -> None:
        sizes, triangles = np.asarray(self.sizes, np.int64), np.asarray(self.triangles, np.int64)
        object.__setattr__(self, "sizes", sizes)
        object.__setattr__(self, "triangles", triangles)
        fitting = sizes.ndim == 1 and triangles.ndim == 2 and (sizes >= 3).all()
        if not fitting or triangles.shape != (int((sizes - 2).sum()), 3):
            raise MeshError(
                f"polygons of shape {sizes.shape} with triangles of shape {triangles.shape} do not fit",
                "give sizes of 3 or more, and a triangle less than the corners of each, minus one",
            )
        local = triangles - self.starts[self.owners][:, None]
        if (local < 0).any() or (local >= sizes[self.owners][:, None]).any():
            raise MeshError(
                "a triangle has corners of another polygon", "keep them in the order of the faces"
            )
        if len(np.unique(triangles)) != sizes.sum():
            raise MeshError("a polygon has a corner that no triangle has", "triangulate it completely")
        if self.vertices is not None and self.vertices.shape != (sizes.sum(),):
            problem = f"{sizes.sum()} corners of polygons have vertices of shape {self.vertices.shape}"
            raise MeshError(problem, "give one vertex per corner")

    @cached_property
    def starts(self) -> np.ndarray:
        """(P,) int64, the first corner of each polygon."""
        return np.cumsum(self.sizes) - self.sizes

    @cached_property
    def owners(self) -> np.ndarray:
        """(F,) int64, the polygon of each triangle."""
        return np.repeat(np.arange(len(self.sizes)), self.sizes - 2)

    def at_corners(self, values: np.ndarray) -> np.ndarray:
        """(N, ...) values of the polygons' corners from those of the triangles' (F, 3, ...)."""
        corners = np.empty((int(self.sizes.sum()), *values.shape[2:]), values.dtype)
        corners[self.triangles] = values
        return corners

    def agreeing(self, values: np.ndarray) -> np.ndarray:
        """(F,) bool: triangles whose values, of (F, 3, C), are those of their polygon (`at_corners`)."""
        return (self.at_corners(values)[self.triangles] == values).all(axis=(1, 2))

    def without(self, faces: np.ndarray, cut: np.ndarray | None = None) -> Polygons:
        """What is left after some faces were dropped.

        Args:
            faces: (F,) bool, the dropped ones. What is left of their polygons is single triangles.
            cut: (F,) bool, further triangles whose polygons become single triangles.
        """
        broken = faces if cut is None else faces | cut
        whole = np.bincount(self.owners[broken], minlength=len(self.sizes)) == 0
        owners = self.owners[~faces]
        whole_face = whole[owners]
        first = ~whole_face | (np.diff(owners, prepend=-1) > 0)
        sizes = np.where(whole_face, self.sizes[owners], 3)[first]
        start = (np.cumsum(sizes) - sizes)[np.cumsum(first) - 1][:, None]
        inside = self.triangles[~faces] - self.starts[owners][:, None]
        rest = Polygons(sizes, start + np.where(whole_face[:, None], inside, np.arange(3)))
        if self.vertices is None:
            return rest
        return replace(rest, vertices=self.vertices[rest.at_corners(self.triangles[~faces])])


def outlines(polygons: Polygons | None, values: Sequence[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """What a file of polygons says.

    Args:
        polygons: those of F triangles, or None if these are all there is.
        values: (F, 3, C) at the triangles' corners. A polygon whose triangles have different ones at a
            corner, as where a chart ends on its diagonal, is left in triangles.

    Returns:
        (P,) numbers of corners, and the values (N, C) at the corners of polygon after polygon.
    """
    count = len(values[0])
    if polygons is None:
        return np.full(count, 3), [v.reshape(-1, v.shape[2]) for v in values]
    cut = ~np.logical_and.reduce([polygons.agreeing(v) for v in values])
    whole = polygons.without(np.zeros(count, bool), cut)
    return whole.sizes, [whole.at_corners(v) for v in values]


def triangulate(points: np.ndarray, corners: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Cuts polygons into triangles that keep their winding and order.

    A quad is cut along its shorter diagonal, or along the one that stays inside where only one does; larger
    polygons in their mean plane.

    Args:
        points: (V, 3) positions.
        corners: (N,) indices into `points`, polygon after polygon.
        sizes: (P,) number of corners of each polygon; smaller than 3 gives nothing.

    Returns:
        (T, 3) int64 indices into `corners`.

    Raises:
        MeshError: a polygon has more than 2000 corners.
    """
    if sizes.size and sizes.max() > MAX_CORNERS:
        raise MeshError(f"a face has {sizes.max()} corners", "triangulate the mesh before exporting it")
    starts = np.cumsum(sizes) - sizes
    owners, pieces = [], []
    for size in np.unique(sizes[sizes >= 3]):
        which = np.flatnonzero(sizes == size)
        index = starts[which, None] + np.arange(size)
        if size == 3:
            triangles = index
        elif size == 4:
            triangles = np.take_along_axis(index[:, None, :], _cut_quads(points[corners[index]]), axis=2)
        else:
            triangles = np.stack([row[_cut(points[corners[row]])] for row in index])
        pieces.append(triangles.reshape(-1, 3))
        owners.append(np.repeat(which, size - 2))
    if not pieces:
        return np.empty((0, 3), np.int64)
    return np.concatenate(pieces)[np.argsort(np.concatenate(owners), kind="stable")]


def _cut_quads(quads: np.ndarray) -> np.ndarray:
    """(Q, 4, 3) positions -> (Q, 2, 3) corner numbers."""
    options = np.array([[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])
    cost = []
    for option, (start, end) in zip(options, ((0, 2), (1, 3)), strict=True):
        normals = triangle_crosses(quads[:, option])
        inside = np.einsum("qk,qk->q", normals[:, 0], normals[:, 1]) > 0.0
        length = np.linalg.norm(quads[:, start] - quads[:, end], axis=1)
        cost.append(np.where(inside, length, np.inf))
    # A hair of preference for the first diagonal makes exact squares come out alike.
    return options[(cost[1] < cost[0] * (1.0 - 1e-6)).astype(int)]


def _cut(polygon: np.ndarray) -> np.ndarray:
    """(n, 3) positions -> (n - 2, 3) corner numbers, by Manifold, whatever the polygon is like."""
    import manifold3d

    if not np.isfinite(polygon).all():
        polygon = np.zeros_like(polygon)  # the mesh will be refused
    return np.asarray(manifold3d.triangulate([_flatten(polygon)], allow_convex=False), np.int64)


def _flatten(polygon: np.ndarray) -> np.ndarray:
    """(n, 3) -> (n, 2) coordinates in the mean plane (Newell's normal), counter-clockwise."""
    centred = polygon - polygon.mean(axis=0)
    normal = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    plane = centred[:, [(axis + 1) % 3, (axis + 2) % 3]]
    return plane if normal[axis] >= 0.0 else plane[:, ::-1]
