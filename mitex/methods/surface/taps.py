"""Finding the levels of a surface: geodesic taps, the texel graph, pooling groups.

Kovacs et al. 2024, sections 3.1 to 3.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import connected_components

from mitex.methods.surface.exponential import GeodesicTracer
from mitex.methods.surface.levels import POOLS, Level, Levels
from mitex.methods.surface.texels import Texels

BACKWARD = 8  # samples along a geodesic that is walked back
CENTRE = 4
OUTER = (0, 1, 2, 3, 5, 6, 7, 8)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What taps are found with.

    Attributes:
        texels: the texels of the surface.
        tracer: of the mesh.
        right, up: (N, 3) tangent frames of the texels.
        correct: walk a geodesic back that overshoots (figure 3).
    """

    texels: Texels
    tracer: GeodesicTracer
    right: np.ndarray
    up: np.ndarray
    correct: bool = True

    def arrivals(
        self, start: np.ndarray, tap: int, length: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Exponential map of a tap from texels `start` (M,): bilinear texels and weights (M, 4) where the
        geodesic ends, and whether it arrived (M,). `length` is that of a straight tap (equation 3).
        """
        row, column = divmod(tap, 3)
        x, y = column - 1, row - 1  # y downwards, as rows of an image
        direction = x * self.right[start] - y * self.up[start]
        texels = self.texels
        end = self.tracer.trace(
            texels.face[start], texels.barycentric[start], direction, length * math.hypot(x, y)
        )
        index, weight = texels.bilinear(end.face, end.barycentric)
        return index, weight, end.arrived


def build(around: Surroundings, count: int = POOLS) -> Levels:
    """Finds taps and groups of `count` levels by geodesics.

    Linear in texels but for sorting.
    """
    texels = around.texels
    index, weight = _bilinear_taps(around)
    edges = _texel_graph(index, weight)
    labels = _groups(texels, edges, count)
    order = np.lexsort(labels).astype(np.int32)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order), dtype=np.int32)
    labels = [_renumbered(label[order]) for label in labels]
    index, weight, edges = rank[index[order]], weight[order], rank[edges]
    taps = [np.take_along_axis(index, np.argmax(weight, axis=2, keepdims=True), 2)[:, :, 0]]
    taps += [_group_taps(around, order, rank, labels[n], edges, n) for n in range(1, count)]
    levels = []
    for n in range(count):
        first = np.concatenate([[True], labels[n][1:] != labels[n][:-1]])
        levels.append(Level(taps[n], np.bincount(labels[n + 1][first]).astype(np.int32)))
    return Levels(order, index, weight, tuple(levels))


def _bilinear_taps(around: Surroundings) -> tuple[np.ndarray, np.ndarray]:
    """(N, 9, 4) texels and weights; a tap that does not arrive is the opposite one, else the centre."""
    count = len(around.texels.index)
    own = np.arange(count, dtype=np.int32)
    index = np.empty((count, 9, 4), np.int32)
    weight = np.zeros((count, 9, 4), np.float32)
    arrived = np.ones((count, 9), bool)
    index[:, CENTRE], weight[:, CENTRE, 0] = own[:, None], 1.0
    for tap in OUTER:
        index[:, tap], weight[:, tap], arrived[:, tap] = around.arrivals(own, tap, around.texels.size)
    rows, source = own[:, None], _replacements(arrived)
    return index[rows, source], weight[rows, source]


def _replacements(arrived: np.ndarray) -> np.ndarray:
    """(n, 9) the tap to use for each tap: itself, the opposite one, or the centre."""
    own = np.arange(9)
    return np.where(arrived, own, np.where(arrived[:, ::-1], own[::-1], CENTRE))


def _texel_graph(index: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(E, 2) pairs of texels of which one reads the other, each once in either direction."""
    count = len(index)
    used = (weight > 0).reshape(count, -1)
    ends = np.concatenate([[0], np.cumsum(used.sum(1))])
    entries = np.ones(ends[-1], bool), index.reshape(count, -1)[used], ends
    reads = scipy.sparse.csr_array(entries, shape=(count, count))
    reads.sum_duplicates()
    graph = (reads + reads.T.tocsr()).tocoo()
    first, second = graph.coords
    return np.stack([first, second], 1)[first != second]


def _groups(texels: Texels, edges: np.ndarray, depth: int) -> list[np.ndarray]:
    """Labels (N,) of the texels' groups in levels 0 to `depth` (section 3.2).

    A group holds the texels of a voxel of side 2^n s that are connected within it.
    """
    count = len(texels.index)
    # The lowest texel centres are half a texel inside; the rest keeps rounding away from the voxels' walls.
    offset = (texels.position - texels.position.min(0)) / texels.size + (0.5 - 1e-3)
    labels = [np.arange(count)]
    for n in range(1, depth + 1):
        voxel = np.floor(offset / 2**n).astype(np.int64)
        key = np.asarray(np.ravel_multi_index(tuple(voxel.T), tuple(voxel.max(0) + 1)))
        inside = edges[key[edges[:, 0]] == key[edges[:, 1]]]
        graph = scipy.sparse.coo_array((np.ones(len(inside), bool), tuple(inside.T)), shape=(count, count))
        labels.append(connected_components(graph, directed=False)[1])
    return labels


def _renumbered(labels: np.ndarray) -> np.ndarray:
    """Labels of which equal ones are adjacent, numbered 0, 1, ..."""
    return np.concatenate([[0], np.cumsum(labels[1:] != labels[:-1])]).astype(np.int32)


def representatives(position: np.ndarray, labels: np.ndarray, size: float) -> np.ndarray:
    """(m,) for each group the texel nearest to the mean of its texels; among equals the first.

    Args:
        position: (N, 3) of texels.
        labels: (N,) ascending group of each.
        size: of a texel; distances are told apart to a thousandth of it.
    """
    count = np.bincount(labels)
    mean = np.stack([np.bincount(labels, position[:, k]) for k in range(3)], 1) / count[:, None]
    distance = np.linalg.norm(position - mean[labels], axis=1)
    ranked = np.lexsort((np.round(distance / (1e-3 * size)), labels))
    return ranked[np.cumsum(count) - count]


def _group_taps(
    around: Surroundings,
    order: np.ndarray,
    rank: np.ndarray,
    labels: np.ndarray,
    edges: np.ndarray,
    level: int,
) -> np.ndarray:
    """(m, 9) int32 taps of the groups of a level, by geodesics from their representatives."""
    texels = around.texels
    start = order[representatives(texels.position[order], labels, texels.size)]
    related = _related(labels, edges) if around.correct else None
    taps = np.empty((len(start), 9), np.int32)
    taps[:, CENTRE] = np.arange(len(start))
    for tap in OUTER:
        taps[:, tap] = _reached(around, start, tap, texels.size * 2**level, labels[rank], related)
    return np.take_along_axis(taps, _replacements(taps >= 0), 1)


def _reached(
    around: Surroundings,
    start: np.ndarray,
    tap: int,
    length: float,
    group: np.ndarray,
    related: Callable[[np.ndarray, np.ndarray], np.ndarray] | None,
) -> np.ndarray:
    """(m,) the group that a tap of each group reads, -1 where the geodesic fails.

    The geodesic is walked back until it is in a group that is `related` to its own (figure 3).
    """
    reached = np.full(len(start), -1, np.int32)
    searching = np.arange(len(start))
    for part in range(BACKWARD, 0, -1):
        index, weight, arrived = around.arrivals(start[searching], tap, length * part / BACKWARD)
        found = group[index]
        if related is not None:
            weight = np.where(related(searching[:, None], found), weight, 0.0)
        best = np.argmax(weight, axis=1, keepdims=True)
        hit = arrived & (np.take_along_axis(weight, best, 1)[:, 0] > 0)
        reached[searching[hit]] = np.take_along_axis(found, best, 1)[hit, 0]
        searching = searching[arrived & ~hit]
        if not len(searching):
            break
    return reached


def _related(labels: np.ndarray, edges: np.ndarray) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Tells of groups a and b (arrays that broadcast) whether they are equal or share an edge."""
    count = int(labels[-1]) + 1
    own = np.arange(count, dtype=np.int64)
    keys = labels[edges[:, 0]].astype(np.int64) * count + labels[edges[:, 1]]
    keys = np.unique(np.concatenate([keys, own * count + own]))

    def related(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        wanted = a.astype(np.int64) * count + b
        return keys[np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)] == wanted

    return related
