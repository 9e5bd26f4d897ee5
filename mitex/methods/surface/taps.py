"""Finding the levels of a surface: geodesic taps, the texel graph, pooling groups.

Kovacs et al. 2024, sections 3.1 to 3.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse
from scipy.sparse.csgraph import connected_components

from mitex.geometry.vectors import scatter_add
from mitex.methods.surface.borders import Border
from mitex.methods.surface.exponential import GeodesicTracer
from mitex.methods.surface.levels import POOLS, Level, Levels
from mitex.progress import announce
from mitex.texels import Texels

BACKWARD = 8  # samples along a geodesic that is walked back
ROUNDING = 1e-6  # of steps that are meant to be 1
CENTRE = 4  # the tap on the element itself
OUTER = (0, 1, 2, 3, 5, 6, 7, 8)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What taps are computed from.

    Attributes:
        texels: the texels of the surface.
        tracer: of the mesh.
        right, up: (N, 3) tangent frames of the texels.
        correct: walk a geodesic back that overshoots (figure 3).
        border: which texels have values of their own; all if None.
        steps: (N,) how far apart the taps of each texel are [texels], where the pattern's size varies.
    """

    texels: Texels
    tracer: GeodesicTracer
    right: np.ndarray
    up: np.ndarray
    correct: bool = True
    border: Border | None = None
    steps: np.ndarray | None = None

    @property
    def widening(self) -> np.ndarray:
        """(N,) `steps`, 1 everywhere if they are not given."""
        return np.ones(len(self.texels.index)) if self.steps is None else self.steps

    def arrivals(
        self, start: np.ndarray, tap: int, length: float | np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The exponential map of a tap.

        Args:
            start: (M,) texels.
            tap: 0 to 8, row by row.
            length: of a tap to the side or up and down [mesh units] (equation 3), one or (M,); diagonal ones
                are longer.

        Returns:
            The texels and weights of a bilinear lookup where the geodesics end, (M, 4) each, and (M,) whether
            they arrived.
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
    """Finds taps and groups of `count` levels by geodesics, in time linear in the texels but for sorting."""
    texels = around.texels
    border = around.border or Border.none(len(texels.index))
    elements, leader = border.elements, _largest(border.spread)
    step = texels.size * around.widening
    index, weight = _bilinear_taps(around, elements, step[elements])
    lookup: Any = _lookup(index, weight, len(texels.index)) @ border.spread
    if (around.widening > 1.0 + ROUNDING).any():
        lookup = lookup @ _footprints(around, border)
    edges = _texel_graph(lookup)
    labels = _groups(texels.position[elements], texels.size, edges, count, around.widening[elements])
    order = np.lexsort(labels).astype(np.int32)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order), dtype=np.int32)
    labels, edges = [_renumbered(label[order]) for label in labels], rank[edges]
    nearest = np.take_along_axis(index, np.argmax(weight, axis=2, keepdims=True), 2)[:, :, 0]
    taps = [rank[leader[nearest[order]]]]
    own, leader = elements[order].astype(np.int32), rank[leader]
    for n in range(1, count):
        announce("following geodesics from groups of texels", n - 1, count - 1)
        taps.append(_group_taps(around, own, leader, labels[n], edges, n))
    levels = []
    for n in range(count):
        first = np.concatenate([[True], labels[n][1:] != labels[n][:-1]])
        levels.append(Level(taps[n], np.bincount(labels[n + 1][first]).astype(np.int32)))
    lookup = _renamed(lookup[(9 * order[:, None] + np.arange(9)).ravel()], rank)
    position = texels.position[own].astype(np.float32)
    return Levels(own, position, lookup, _renamed(border.spread, rank), tuple(levels))


def _bilinear_taps(
    around: Surroundings, elements: np.ndarray, step: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 9, 4) texels and weights of texels `elements` (n,) whose taps are `step` (n,) apart [mesh units].

    A tap that does not arrive is the opposite one, else the centre.
    """
    count = len(elements)
    index = np.empty((count, 9, 4), np.int32)
    weight = np.zeros((count, 9, 4), np.float32)
    arrived = np.ones((count, 9), bool)
    index[:, CENTRE], weight[:, CENTRE, 0] = elements[:, None], 1.0
    for tap in OUTER:
        index[:, tap], weight[:, tap], arrived[:, tap] = around.arrivals(elements, tap, step)
    rows, source = np.arange(count)[:, None], _replacements(arrived)
    return index[rows, source], weight[rows, source]


def _footprints(around: Surroundings, border: Border) -> Any:
    """(n, n) CSR: what taps read in place of each element, so that they pass over no texel where they are
    more than one apart: the mean of a square whose side is the root of their squared step less a texel's.
    """
    step, elements = around.widening, border.elements
    width = np.sqrt(np.maximum(step[elements] ** 2 - 1.0, 0.0))
    index, weight = _bilinear_taps(around, elements, around.texels.size * width / 3)
    count = len(elements)
    ones = np.full(9 * count, 1 / 9, np.float32), np.arange(9 * count), 9 * np.arange(count + 1)
    mean: Any = scipy.sparse.csr_array(ones, shape=(count, 9 * count))
    return mean @ _lookup(index, weight, len(step)) @ border.spread


def _lookup(index: np.ndarray, weight: np.ndarray, texels: int) -> scipy.sparse.csr_array:
    """(9 n, texels) matrix of bilinear taps (n, 9, 4)."""
    used = weight.reshape(-1, 4) > 0
    ends = np.concatenate([[0], np.cumsum(used.sum(1))])
    entries = weight.reshape(-1, 4)[used], index.reshape(-1, 4)[used], ends
    return scipy.sparse.csr_array(entries, shape=(len(used), texels))


def _renamed(matrix: Any, rank: np.ndarray) -> scipy.sparse.csr_array:
    """The matrix with column j called rank[j], indices of 32 bits."""
    entries = matrix.data, rank[matrix.indices], matrix.indptr.astype(np.int32)
    return scipy.sparse.csr_array(entries, shape=matrix.shape)


def _largest(matrix: Any) -> np.ndarray:
    """The column of the largest entry of each row; no row is empty."""
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    return matrix.indices[np.lexsort((matrix.data, rows))[matrix.indptr[1:] - 1]]


def _replacements(arrived: np.ndarray) -> np.ndarray:
    """(n, 9) the tap to use for each tap: itself, the opposite one, or the centre."""
    own = np.arange(9)
    return np.where(arrived, own, np.where(arrived[:, ::-1], own[::-1], CENTRE))


def _texel_graph(lookup: Any) -> np.ndarray:
    """(E, 2) pairs of elements of which one reads the other, each once in either direction."""
    count = lookup.shape[1]
    entries = np.ones(lookup.nnz, bool), lookup.indices.copy(), lookup.indptr[::9].copy()
    reads = scipy.sparse.csr_array(entries, shape=(count, count))
    reads.sum_duplicates()
    graph = (reads + reads.T.tocsr()).tocoo()
    first, second = graph.coords
    return np.stack([first, second], 1)[first != second]


def _groups(
    position: np.ndarray, size: float, edges: np.ndarray, depth: int, steps: np.ndarray
) -> list[np.ndarray]:
    """Labels (n,) of the groups of texels at (n, 3) in levels 0 to `depth` (section 3.2).

    A group holds the texels of a voxel of side 2^n s that are connected within it. Where taps are `steps`
    (n,) texels apart, the side is as many times larger, to the next half of an octave: only texels with the
    same side join, and every group lies in one of the next level.
    """
    count = len(position)
    # The lowest texel centres are half a texel inside; the rest keeps rounding away from the voxels' walls.
    offset = (position - position.min(0)) / size + (0.5 - 1e-3)
    octave = np.round(2 * np.log2(steps))[:, None]
    offset = offset / 2 ** (octave / 2)
    labels = [np.arange(count)]
    for n in range(1, depth + 1):
        voxel = np.hstack([np.floor(offset / 2**n), octave - octave.min()]).astype(np.int64)
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
    mean = scatter_add(labels, position, len(count)) / count[:, None]
    distance = np.linalg.norm(position - mean[labels], axis=1)
    ranked = np.lexsort((np.round(distance / (1e-3 * size)), labels))
    return ranked[np.cumsum(count) - count]


def _group_taps(
    around: Surroundings,
    own: np.ndarray,
    leader: np.ndarray,
    labels: np.ndarray,
    edges: np.ndarray,
    level: int,
) -> np.ndarray:
    """(m, 9) int32 taps of the groups of a level, by geodesics from their representatives.

    Args:
        around: of the surface.
        own: (n,) texels of the elements of level 0.
        leader: (N,) the element that has the largest share in each texel.
        labels: (n,) ascending groups of the elements.
        edges: (E, 2) neighbouring elements.
        level: n.
    """
    texels = around.texels
    start = own[representatives(texels.position[own], labels, texels.size)]
    related = _related(labels, edges) if around.correct else None
    length = texels.size * 2**level * around.widening[start]
    taps = np.empty((len(start), 9), np.int32)
    taps[:, CENTRE] = np.arange(len(start))
    for tap in OUTER:
        taps[:, tap] = _reached(around, start, tap, length, labels[leader], related)
    return np.take_along_axis(taps, _replacements(taps >= 0), 1)


def _reached(
    around: Surroundings,
    start: np.ndarray,
    tap: int,
    length: np.ndarray,
    group: np.ndarray,
    related: Callable[[np.ndarray, np.ndarray], np.ndarray] | None,
) -> np.ndarray:
    """(m,) the group that a tap of each group reads, -1 where the geodesic fails.

    The geodesic is walked back until it is in a group that is `related` to its own (figure 3).
    """
    reached = np.full(len(start), -1, np.int32)
    searching = np.arange(len(start))
    for part in range(BACKWARD, 0, -1):
        index, weight, arrived = around.arrivals(start[searching], tap, length[searching] * part / BACKWARD)
        read = group[index]
        if related is not None:
            weight = np.where(related(searching[:, None], read), weight, 0.0)
        best = np.argmax(weight, axis=1, keepdims=True)
        hit = arrived & (np.take_along_axis(weight, best, 1)[:, 0] > 0)
        reached[searching[hit]] = np.take_along_axis(read, best, 1)[hit, 0]
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
        key = a.astype(np.int64) * count + b
        return keys[np.minimum(np.searchsorted(keys, key), len(keys) - 1)] == key

    return related
