"""The nearest vertices of many points, by lists for the cells of a grid."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import KDTree

from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.runtime.workers import tree_threads

CELL = 1.5  # side of a cell [spacings]
EXTRA = 3  # vertices looked up at a cell's corners beyond the K nearest
LENGTH = 5  # of a list, at most, in vertices looked up at a corner
MARGIN = 0.25  # the grid goes beyond the vertices by this [diagonals of their bounding box]
SIDE = 192  # cells along a side, at most
CELLS = 1 << 19  # with a list, at most: 100 MB for 8 neighbours
CORNERS = np.indices((2, 2, 2)).reshape(3, 8).T

UNLISTED, FAR, NEW = -1, -2, -3


class NearestVertices:
    """The K nearest of some vertices.

    A k-d tree takes two to four microseconds for a point. But the points of a shell come back to the same
    places: the first that falls into a cell has a list made of all vertices that are among the K + 3 nearest
    of one of the cell's corners, and Dr.Jit picks the K nearest of the list in a twentieth of the time. A
    vertex is missing from a list only where the order changes within a cell and at none of its corners: for
    one point of thousands the last of the eight is the ninth.

    Args:
        vertices: (V, 3) float32.
        count: K, at most V.
        spacing: typical distance of neighbours, the size of the cells; anything positive is right.
        limit: points that are surely farther from all vertices are `FAR`.
    """

    def __init__(self, vertices: np.ndarray, count: int, spacing: float, limit: float = math.inf) -> None:
        self.count, self.limit = count, limit
        self._tree = KDTree(vertices)
        self._vertices = upload(mi.Float, vertices.ravel())
        margin = MARGIN * float(np.linalg.norm(np.ptp(vertices, axis=0)))
        self._low = vertices.min(axis=0) - np.float32(margin)
        extent = np.ptp(vertices, axis=0) + 2 * margin
        self._cell = np.float32(max(CELL * spacing, extent.max() / SIDE))
        self._shape = np.ceil(extent / self._cell).astype(np.int64)
        self._lookup = min(count + EXTRA, len(vertices))
        self._slot = np.full(int(self._shape.prod()), NEW, np.int32)
        self._corner = np.full(int((self._shape + 1).prod()), NEW, np.int32)
        self._around = np.zeros((0, self._lookup), np.uint32)
        self._apart = np.zeros(0, np.float32)
        self._width = LENGTH * self._lookup
        self._entries, self._lengths = Growing(), Growing()

    def __call__(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Finds the nearest vertices of points (N, 3) float32.

        Returns:
            (M,) ascending indices of the points that are not surely beyond the limit, and (M, K) uint32
            vertices, from the nearest on.
        """
        slots = self._slots(points)
        listed = np.flatnonzero(slots >= 0)
        if len(listed) == len(points):
            return listed, self._from_lists(points, slots)
        others = np.flatnonzero(slots == UNLISTED)
        near, index = self._from_tree(points[others])
        points_near = np.concatenate([listed, others[near]])
        order = np.argsort(points_near)
        index = np.concatenate([self._from_lists(points[listed], slots[listed]), index])
        return points_near[order], index[order]

    def _slots(self, points: np.ndarray) -> np.ndarray:
        """(N,) int32 number of the list of each point's cell; `UNLISTED` or `FAR` without one."""
        place = (points - self._low) / self._cell
        in_grid = ((place >= 0) & (place < self._shape)).all(axis=1)
        cell = place[in_grid].astype(np.int64)
        flat = (cell[:, 0] * self._shape[1] + cell[:, 1]) * self._shape[2] + cell[:, 2]
        slot = self._slot[flat]
        new = slot == NEW
        if new.any():
            self._list(np.unique(flat[new]))
            slot = self._slot[flat]
        slots = np.full(len(points), UNLISTED, np.int32)
        slots[in_grid] = slot
        return slots

    def _from_tree(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As `__call__`, by the tree."""
        near = np.arange(len(points))
        workers = tree_threads(len(points))
        if math.isfinite(self.limit):
            distance, _ = self._tree.query(points, k=1, distance_upper_bound=self.limit, workers=workers)
            near = np.flatnonzero(np.isfinite(distance))
        _, index = self._tree.query(points[near], k=self.count, workers=workers)
        return near, index.reshape(-1, self.count).astype(np.uint32)

    def _from_lists(self, points: np.ndarray, slots: np.ndarray) -> np.ndarray:
        """(N, K) uint32 nearest vertices of points (N, 3), by the lists (N,) of their cells."""
        if not len(points):
            return np.zeros((0, self.count), np.uint32)
        with dr.suspend_grad():
            x = dr.unravel(mi.Point3f, upload(mi.Float, points.ravel()))
            index = dr.ravel(mi.ArrayXu(self._nearest(x, upload(mi.UInt32, slots.astype(np.uint32)))))
        return np.asarray(index).reshape(-1, self.count)

    @dr.syntax
    def _nearest(self, x: mi.Point3f, slot: mi.UInt32) -> list[mi.UInt32]:
        """K `mi.UInt32`, from the nearest on, for points `mi.Point3f` with lists `mi.UInt32`."""
        distances = [mi.Float(dr.inf) for _ in range(self.count)]
        nearest = [mi.UInt32(0) for _ in range(self.count)]
        first, length = slot * self._width, dr.gather(mi.UInt32, self._lengths.values, slot)
        entry = mi.UInt32(0)
        while entry < length:
            vertex = dr.gather(mi.UInt32, self._entries.values, first + entry)
            distance = dr.squared_norm(dr.gather(mi.Point3f, self._vertices, vertex) - x)
            # Sorted insertion: what is put aside goes on down the row.
            for k in range(self.count):
                closer = distance < distances[k]
                closest = dr.select(closer, vertex, nearest[k])
                vertex = dr.select(closer, nearest[k], vertex)
                nearest[k] = closest
                shortest = dr.minimum(distance, distances[k])
                distance = dr.maximum(distance, distances[k])
                distances[k] = shortest
            entry += 1
        return nearest

    def _list(self, cells: np.ndarray) -> None:
        """Makes the lists of cells, given by their ascending flat numbers."""
        at = np.stack(np.unravel_index(cells, self._shape), axis=1)
        corners = np.ravel_multi_index(tuple((at[:, None] + CORNERS).T), tuple(self._shape + 1))
        used = self._looked_up(np.transpose(corners))
        # No place in a cell is farther from the nearest corner than half a diagonal.
        far = self._apart[used].min(axis=1) - 0.5 * math.sqrt(3.0) * self._cell > self.limit
        entries = np.sort(self._around[used].reshape(len(cells), -1), axis=1)
        different = np.diff(entries.astype(np.int64), axis=1, prepend=-1) > 0
        length = different.sum(axis=1)
        usable = ~far & (length <= self._width)
        usable[np.flatnonzero(usable)[CELLS - len(self._lengths) :]] = False
        self._slot[cells] = np.where(far, FAR, UNLISTED)
        self._slot[cells[usable]] = len(self._lengths) + np.arange(usable.sum())
        self._append(entries[usable], different[usable])

    def _looked_up(self, corners: np.ndarray) -> np.ndarray:
        """(C, 8) where the vertices nearest to corners (C, 8), flat numbers, are kept.

        Cells that are listed later share most of their corners with those that are.
        """
        new = np.unique(corners[self._corner[corners] == NEW])
        if len(new):
            points = self._low + self._cell * np.stack(np.unravel_index(new, self._shape + 1), axis=1)
            distance, index = self._tree.query(points, k=self._lookup, workers=tree_threads(len(points)))
            distance, index = (a.reshape(len(new), -1) for a in (distance, index))
            self._corner[new] = len(self._apart) + np.arange(len(new))
            self._around = np.concatenate([self._around, index.astype(np.uint32)])
            self._apart = np.concatenate([self._apart, distance[:, 0].astype(np.float32)])
        return self._corner[corners]

    def _append(self, entries: np.ndarray, different: np.ndarray) -> None:
        """Adds lists of the entries (C, E) that are different from the one before."""
        lists = np.zeros((len(entries), self._width), np.uint32)
        lists[np.nonzero(different)[0], (different.cumsum(axis=1) - 1)[different]] = entries[different]
        self._entries.append(lists.ravel())
        self._lengths.append(different.sum(axis=1, dtype=np.uint32))


class Growing:
    """Numbers for Dr.Jit, `values`, which grow at their end; there is room for twice as many as needed.

    Copying all of them for a few more, step by step, would take most of the time of the first steps of a fit.
    """

    def __init__(self) -> None:
        self.values, self._count = mi.UInt32(), 0

    def __len__(self) -> int:
        return self._count

    def append(self, numbers: np.ndarray) -> None:
        """Adds some, (N,) uint32."""
        count = self._count + len(numbers)
        if count > dr.width(self.values):
            before, self.values = self.values, dr.zeros(mi.UInt32, 2 * count)
            if self._count:
                dr.scatter(self.values, before, dr.arange(mi.UInt32, dr.width(before)))
        if len(numbers):
            place = dr.opaque(mi.UInt32, self._count) + dr.arange(mi.UInt32, len(numbers))
            dr.scatter(self.values, upload(mi.UInt32, numbers), place)
        dr.eval(self.values)
        self._count = count
