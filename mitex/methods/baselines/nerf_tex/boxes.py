"""Boxes on a mesh: which of them a point is in, and where there (Baatz et al. 2022)."""

from __future__ import annotations

import numpy as np

from mitex.methods.baselines.nerf_tex.anchors import Anchors
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.march import cells_of

CELLS = 64  # of the grid over the scene cube whose cells know their boxes


class Boxes:
    """Copies of one box, at anchors in the scene cube.

    Attributes:
        frames: (N, 3, 3) as of the anchors.
        half: half a side of the cube that a box is in [scene units].

    Args:
        anchors: in the scene cube.
        half: see above.
        low, high: (3,) corners of the box in its cube [-1, 1]^3.
        lift: of the cubes' middles above the anchors, along their z axes [scene units].
    """

    def __init__(
        self, anchors: Anchors, half: float, low: np.ndarray, high: np.ndarray, lift: float = 0.0
    ) -> None:
        self.frames, self.half = anchors.frames, half
        self._low, self._high = (np.asarray(v, np.float32).tolist() for v in (low, high))
        centres = anchors.points + np.float32(lift) * anchors.frames[:, 2]
        self._centres = upload(mi.Float, np.ascontiguousarray(centres, np.float32).ravel())
        self._axes = upload(mi.Float, np.ascontiguousarray(anchors.frames, np.float32).ravel())
        lists = [_touched(c, f, half, low, high) for c, f in zip(centres, anchors.frames, strict=True)]
        cell = np.concatenate(lists)
        box = np.repeat(np.arange(len(lists)), [len(one) for one in lists])
        order = np.argsort(cell, kind="stable")
        self._members = upload(mi.UInt32, box[order].astype(np.uint32))
        starts = np.searchsorted(cell[order], np.arange(CELLS**3 + 1))
        self._starts = upload(mi.UInt32, starts.astype(np.uint32))
        self.touched = (np.diff(starts) > 0).reshape((CELLS,) * 3)

    def axes(self, box: mi.UInt32) -> list[mi.Vector3f]:
        """The x, y and z axes of boxes in the scene."""
        return [dr.gather(mi.Vector3f, self._axes, box * 3 + k) for k in range(3)]

    def inside(self, box: mi.UInt32, vector: mi.Vector3f) -> mi.Vector3f:
        """Directions of the scene, in the axes of boxes."""
        return mi.Vector3f(*(dr.dot(axis, vector) for axis in self.axes(box)))

    def nearest(self, points: mi.Point3f) -> tuple[mi.UInt32, mi.UInt32, mi.Point3f]:
        """Of the boxes that points of the scene cube are in, the one whose middle is nearest.

        Returns:
            Its number, how many boxes the point is in (0: the rest means nothing), and its place in the cube
            of the nearest one.
        """
        cell = cells_of(points, CELLS)
        place, end = (dr.gather(mi.UInt32, self._starts, cell + k) for k in (0, 1))
        count = dr.width(points)
        state = (
            place,
            dr.full(mi.Float, dr.inf, count),
            dr.zeros(mi.UInt32, count),
            dr.zeros(mi.UInt32, count),
        )

        def body(
            place: mi.UInt32, least: mi.Float, box: mi.UInt32, overlaps: mi.UInt32
        ) -> tuple[mi.UInt32, mi.Float, mi.UInt32, mi.UInt32]:
            other = dr.gather(mi.UInt32, self._members, place)
            local = self._local(points, other)
            within = dr.all((local >= mi.Point3f(self._low)) & (local <= mi.Point3f(self._high)))
            distance = dr.squared_norm(local)
            nearer = within & (distance < least)
            least, box = dr.select(nearer, distance, least), dr.select(nearer, other, box)
            return place + 1, least, box, overlaps + dr.select(within, mi.UInt32(1), mi.UInt32(0))

        _, _, box, overlaps = dr.while_loop(state, lambda place, *_: place < end, body)
        return box, overlaps, self._local(points, box)

    def _local(self, points: mi.Point3f, box: mi.UInt32) -> mi.Point3f:
        offset = points - dr.gather(mi.Point3f, self._centres, box)
        return mi.Point3f(self.inside(box, mi.Vector3f(offset)) / self.half)


def _touched(
    centre: np.ndarray, frame: np.ndarray, half: float, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Cells of the scene cube, x slowest, that a box may touch."""
    size = 2 / CELLS
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    world = centre + half * np.where(corners, high, low) @ frame
    first, last = (np.clip(((v + 1) / size).astype(int), 0, CELLS - 1) for v in (world.min(0), world.max(0)))
    axes = [np.arange(a, b + 1) for a, b in zip(first, last, strict=True)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    local = ((cells + 0.5) * size - 1 - centre) @ frame.T / half
    margin = np.sqrt(3) / CELLS / half
    near = ((local > low - margin) & (local < high + margin)).all(1)
    return (cells[near] @ np.array([CELLS * CELLS, CELLS, 1])).astype(np.int64)
