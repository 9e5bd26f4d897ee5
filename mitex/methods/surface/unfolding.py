"""The faces of a mesh laid flat one by one, and which side of which face each of their sides is glued to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.mesh import Mesh
from mitex.mesh.topology import paired_sides, welded
from mitex.mesh.validate import degenerate_faces


@dataclass(frozen=True, eq=False)
class Unfolding:
    """What a walk over the faces needs; side k of a face runs from its corner k to its corner k + 1.

    Every face has its own plane with the corners at (0, 0), (l, 0) and (x, y), where l, y >= 0. So its inside
    is to the left of all sides, also where the windings of neighbours disagree. Faces without an area have
    y = 0.

    Attributes:
        shape: (F, 3) float64, the numbers l, x and y [mesh units].
        axes: (F, 2, 3) float64, the plane's unit axes in object space; zero for faces without an area.
        glued: (F, 3) int32, 2 (3 G + s) + r where the side is glued to side s of face G; r is 1 if both run
            in the same direction (the windings disagree). -1 for a boundary.
    """

    shape: np.ndarray
    axes: np.ndarray
    glued: np.ndarray


def unfold(mesh: Mesh) -> Unfolding:
    """Lays the faces of `mesh` flat and glues them.

    Sides are glued where exactly two faces share them. Vertices at bit-identical positions count as one, so
    that seams of split vertices are crossed. Edges of more than two faces and T-junctions are boundaries.
    Faces that have two corners at one position are left out, which glues the neighbours on their other two
    sides together; no side is glued to them.
    """
    return Unfolding(*_planes(mesh), _glue(welded(mesh.vertices)[mesh.faces]))


def _planes(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    length = np.linalg.norm(b - a, axis=1)
    twice_area = np.linalg.norm(mesh.face_crosses, axis=1)
    flat = degenerate_faces(mesh)
    safe = np.where(length > 0.0, length, 1.0)
    along = (b - a) / safe[:, None]
    normal = mesh.face_crosses / np.where(flat, 1.0, twice_area)[:, None]
    axes = np.where(flat[:, None, None], 0.0, np.stack([along, np.cross(normal, along)], axis=1))
    height = np.where(flat, 0.0, twice_area / safe)
    return np.stack([length, ((c - a) * along).sum(axis=1), height], axis=1), axes


def _glue(corners: np.ndarray) -> np.ndarray:
    """`Unfolding.glued` of welded corners (F, 3)."""
    glued = np.full((len(corners), 3), -1, np.int32)
    faces = np.flatnonzero((corners != np.roll(corners, 1, axis=1)).all(axis=1))
    if not len(faces):
        return glued
    one, other = paired_sides(corners[faces], int(corners.max()) + 1).T
    start = corners[faces].ravel()
    same = (start[one] == start[other]).astype(np.int64)
    side = (3 * faces[:, None] + np.arange(3)).ravel()  # their sides in the numbers of all
    glued.reshape(-1)[side[one]] = 2 * side[other] + same
    glued.reshape(-1)[side[other]] = 2 * side[one] + same
    return glued
