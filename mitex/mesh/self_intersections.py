"""Faces of a mesh that pierce each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import KDTree

from mitex.mesh.mesh import Mesh

BLOCK = 4096  # faces whose neighbourhoods are looked at together
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
    blocks = [_piercing(corners, pairs) for pairs in _near(corners, wanted)]
    return np.unique(np.concatenate([np.empty((0, 2), np.int64), *blocks]), axis=0)


def _near(corners: np.ndarray, wanted: np.ndarray) -> Iterator[np.ndarray]:
    """Pairs (N, 2) of faces, one of them wanted, whose boxes overlap, in blocks, the lower one first.

    Faces are looked for in classes of size, so that a few large ones do not widen every search.
    """
    low, high = (np.ascontiguousarray(ends.T) for ends in (corners.min(1), corners.max(1)))
    centres = corners.mean(1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(1)
    octave = np.floor(np.log2(np.maximum(radii, 1e-30))).astype(int)
    for size in np.unique(octave):
        members, others = octave == size, octave <= size
        for around, inside in ((others & wanted, members), (others & ~wanted, members & wanted)):
            for one, other in _balls(np.flatnonzero(around), np.flatnonzero(inside), centres, radii):
                pairs = one != other
                for k in range(3):
                    one, other = one[pairs], other[pairs]
                    pairs = (low[k, one] <= high[k, other]) & (low[k, other] <= high[k, one])
                yield np.sort(np.stack([one[pairs], other[pairs]], axis=1), axis=1)


def _balls(
    around: np.ndarray, inside: np.ndarray, centres: np.ndarray, radii: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Faces `around` and faces `inside` whose balls may overlap, (N,) each, in blocks."""
    if not len(inside):
        return
    tree, reach = KDTree(centres[inside]), radii[inside].max()
    for start in range(0, len(around), BLOCK):
        block = around[start : start + BLOCK]
        nearby = tree.query_ball_point(centres[block], radii[block] + reach)
        one = np.repeat(block, [len(faces) for faces in nearby])
        yield one, inside[np.concatenate(nearby).astype(np.int64)]


def _piercing(corners: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Those of pairs (N, 2) of faces that pierce each other.

    The ends of the edge lie on two sides of the plane, and the line passes all three edges on the same side.
    """
    hit = np.zeros(len(pairs), bool)
    for one, other in ((0, 1), (1, 0)):
        ends, face = corners[pairs[:, one]], corners[pairs[:, other]]
        a, b, c = face.swapaxes(0, 1)
        sides = [_side(a, b, c, ends[:, k]) for k in range(3)]
        for k in range(3):
            crossing = np.flatnonzero(sides[k] * sides[(k + 1) % 3] < 0)
            a, b, c = face[crossing].swapaxes(0, 1)
            start, end = ends[crossing, k], ends[crossing, (k + 1) % 3]
            turns = _side(start, end, a, b) + _side(start, end, b, c) + _side(start, end, c, a)
            hit[crossing] |= np.abs(turns) == 3
    return pairs[hit]


def _side(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """(N,) sign of the volume of tetrahedra; 0 where rounding errors could have made it."""
    edges = b - a, c - a, d - a
    volume = (np.cross(edges[0], edges[1]) * edges[2]).sum(1)
    scale = np.prod([np.linalg.norm(edge, axis=1) for edge in edges], axis=0)
    return np.where(np.abs(volume) > ROUNDING * scale, np.sign(volume), 0.0)
