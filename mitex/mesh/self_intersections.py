"""Faces of a mesh that pierce each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import KDTree

from mitex.mesh.mesh import Mesh

BLOCK = 4096  # faces whose neighbourhoods are looked at together
ROUNDING = 1e-12  # volumes that are smaller, relative to their edges, are 0: what touches does not pierce


def piercing_pairs(mesh: Mesh) -> np.ndarray:
    """Pairs of faces of which an edge of one goes through the inside of the other.

    Faces that meet in a vertex, in an edge or in one plane do not count, nor do edges that pass exactly
    through an edge.

    Args:
        mesh: any mesh.

    Returns:
        (P, 2) int64 faces, the lower one first, sorted.
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    blocks = [_piercing(corners, pairs) for pairs in _near(corners)]
    return np.unique(np.concatenate([np.empty((0, 2), np.int64), *blocks]), axis=0)


def _near(corners: np.ndarray) -> Iterator[np.ndarray]:
    """Pairs (N, 2) of faces whose boxes overlap, in blocks, the lower one first.

    Faces are looked for in classes of size, so that a few large ones do not widen every search.
    """
    low, high, centres = corners.min(1), corners.max(1), corners.mean(1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(1)
    octave = np.floor(np.log2(np.maximum(radii, 1e-30))).astype(int)
    for size in np.unique(octave):
        members, others = np.flatnonzero(octave == size), np.flatnonzero(octave <= size)
        tree, reach = KDTree(centres[members]), radii[members].max()
        for start in range(0, len(others), BLOCK):
            block = others[start : start + BLOCK]
            nearby = tree.query_ball_point(centres[block], radii[block] + reach)
            one = np.repeat(block, [len(faces) for faces in nearby])
            other = members[np.concatenate(nearby).astype(np.int64)]
            pairs = np.sort(np.stack([one, other], axis=1), axis=1)
            a, b = pairs.T
            overlap = (a != b) & ((low[a] <= high[b]) & (low[b] <= high[a])).all(1)
            yield pairs[overlap]


def _piercing(corners: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Those of pairs (N, 2) of faces that pierce each other."""
    hit = np.zeros(len(pairs), bool)
    for one, other in ((0, 1), (1, 0)):
        for k in range(3):
            ends, face = corners[pairs[:, one]], corners[pairs[:, other]]
            hit |= _through(ends[:, k], ends[:, (k + 1) % 3], face)
    return pairs[hit]


def _through(start: np.ndarray, end: np.ndarray, face: np.ndarray) -> np.ndarray:
    """(N,) bool: segments between points (N, 3) that go through the inside of triangles (N, 3, 3).

    Their ends lie on two sides of the plane, and the line passes all three edges on the same side.
    """
    a, b, c = face[:, 0], face[:, 1], face[:, 2]
    sides = _side(a, b, c, start) * _side(a, b, c, end) < 0
    turns = _side(start, end, a, b), _side(start, end, b, c), _side(start, end, c, a)
    return sides & (np.abs(turns[0] + turns[1] + turns[2]) == 3)


def _side(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """(N,) sign of the volume of tetrahedra; 0 where rounding errors could have made it."""
    edges = b - a, c - a, d - a
    volume = (np.cross(edges[0], edges[1]) * edges[2]).sum(1)
    scale = np.prod([np.linalg.norm(edge, axis=1) for edge in edges], axis=0)
    return np.where(np.abs(volume) > ROUNDING * scale, np.sign(volume), 0.0)
