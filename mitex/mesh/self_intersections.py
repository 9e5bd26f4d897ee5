"""Faces of a mesh that pierce each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mitex.geometry.vectors import dot
from mitex.mesh.box_tree import BoxTree
from mitex.mesh.mesh import Mesh

ROUNDING = 1e-12  # volumes that are smaller, relative to their edges, are 0: what touches does not pierce


def piercing_pairs(mesh: Mesh, faces: np.ndarray | None = None) -> np.ndarray:
    """Pairs of faces of which an edge of one goes through the inside of the other.

    Faces that meet in a vertex, in an edge or in one plane do not count, nor do edges that pass exactly
    through an edge.

    Args:
        mesh: any mesh.
        faces: numbers of those of which a pair has at least one; None for all pairs.

    Returns:
        (P, 2) int64 faces, the lower one first, sorted.
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    wanted = np.full(len(corners), faces is None)
    if faces is not None:
        wanted[faces] = True
    planes = _plane(*corners.swapaxes(0, 1))
    tree = BoxTree(corners.min(1), corners.max(1), wanted)
    blocks = [
        pairs[_pierce(corners, planes, *pairs.T) | _pierce(corners, planes, *pairs.T[::-1])]
        for pairs in tree.pairs()
    ]
    return np.unique(np.sort(np.concatenate([np.empty((0, 2), np.int64), *blocks]), axis=1), axis=0)


def _pierce(corners: np.ndarray, planes: Plane, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Whether an edge of the faces `one` (N,) goes through the inside of the faces `other` (N,): (N,) bool.

    The ends of the edge lie on two sides of the plane, and the line passes all three edges on the same side.

    Args:
        corners: (F, 3, 3) of all faces.
        planes: of all faces.
    """
    hit = np.zeros(len(one), bool)
    plane = Plane(*(values[other] for values in planes))
    sides = [plane.side(corners[one, k]) for k in range(3)]
    for k in range(3):
        crossing = np.flatnonzero(sides[k] * sides[(k + 1) % 3] < 0)
        start, end = corners[one[crossing], k], corners[one[crossing], (k + 1) % 3]
        face = corners[other[crossing]].swapaxes(0, 1)
        turns = sum(_plane(start, end, face[j]).side(face[(j + 1) % 3]) for j in range(3))
        hit[crossing] |= np.abs(turns) == 3
    return hit


class Plane(NamedTuple):
    """Planes through triangles (N,)."""

    origin: np.ndarray  # (N, 3), their first corners
    normal: np.ndarray  # (N, 3), twice their areas long
    size: np.ndarray  # (N,), product of the edges at their first corners

    def side(self, points: np.ndarray) -> np.ndarray:
        """(N,) signs of the volumes that triangles and points (N, 3) span; 0 if rounding may have made it."""
        edge = points - self.origin
        volume = dot(self.normal, edge)
        return np.where(
            np.abs(volume) > ROUNDING * self.size * np.sqrt(dot(edge, edge)), np.sign(volume), 0.0
        )


def _plane(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> Plane:
    """Through points (N, 3)."""
    edges = b - a, c - a
    return Plane(a, np.cross(*edges), np.sqrt(dot(edges[0], edges[0]) * dot(edges[1], edges[1])))
