"""A tree of boxes, and the pairs of them that overlap."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

BITS = 21  # of each coordinate of a Morton code
BLOCK = 1 << 16  # pairs that are split at once


class BoxTree:
    """A balanced binary tree over boxes in the order of their Morton codes.

    Args:
        low, high: (N, 3) corners of the boxes.
        wanted: (N,) bool, those of which a pair has at least one.
    """

    def __init__(self, low: np.ndarray, high: np.ndarray, wanted: np.ndarray) -> None:
        self._order = np.argsort(morton_codes((low + high) / 2))
        depth = max(len(low) - 1, 0).bit_length()
        spare = (1 << depth) - len(low)  # leaves that overlap nothing
        low = np.concatenate([low[self._order], np.full((spare, 3), np.inf)])
        high = np.concatenate([high[self._order], np.full((spare, 3), -np.inf)])
        wanted = np.concatenate([wanted[self._order], np.zeros(spare, bool)])
        self._levels = [(low, high, wanted)]
        for _ in range(depth):
            low, high = low.reshape(-1, 2, 3).min(1), high.reshape(-1, 2, 3).max(1)
            wanted = wanted[::2] | wanted[1::2]
            self._levels.insert(0, (low, high, wanted))

    def pairs(self) -> Iterator[np.ndarray]:
        """Pairs (P, 2) of boxes, one of them wanted, that overlap or touch, each once, in blocks."""
        if len(self._order):
            for nodes in self._leaves(np.zeros((1, 2), np.int64), 0):
                yield self._order[nodes[nodes[:, 0] < nodes[:, 1]]]

    def _leaves(self, nodes: np.ndarray, level: int) -> Iterator[np.ndarray]:
        """Overlapping pairs of leaves below pairs of nodes (P, 2), the lower one first."""
        if level == len(self._levels) - 1:
            yield nodes
            return
        for start in range(0, len(nodes), BLOCK):
            block = nodes[start : start + BLOCK]
            children = (2 * block[:, None] + [(0, 0), (0, 1), (1, 0), (1, 1)]).reshape(-1, 2)
            yield from self._leaves(self._overlapping(children, level + 1), level + 1)

    def _overlapping(self, nodes: np.ndarray, level: int) -> np.ndarray:
        """Those of pairs of nodes (P, 2), each once, whose boxes overlap and of which one is wanted."""
        low, high, wanted = self._levels[level]
        one, other = nodes[nodes[:, 0] <= nodes[:, 1]].T
        keep = wanted[one] | wanted[other]
        for k in range(3):
            one, other = one[keep], other[keep]
            keep = (low[one, k] <= high[other, k]) & (low[other, k] <= high[one, k])
        return np.stack([one[keep], other[keep]], axis=1)


def morton_codes(points: np.ndarray) -> np.ndarray:
    """(N,) uint64 places of points (N, 3) along a Z-order curve through their bounding box."""
    codes = np.zeros(len(points), np.uint64)
    if len(points):
        low = points.min(0)
        extent = (points.max(0) - low).max() or 1.0
        cells = ((points - low) / extent * (2**BITS - 1)).astype(np.uint64)
        for bit in range(BITS):
            for axis in range(3):
                codes |= (cells[:, axis] >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return codes
