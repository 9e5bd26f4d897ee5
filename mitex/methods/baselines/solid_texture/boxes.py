"""Boxes of voxels, and which of them a network of several scales needs for one at the finest scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

BORDER = 2  # voxels that two unpadded 3 x 3 x 3 convolutions take away on each side


@dataclass(frozen=True)
class Box:
    """Voxels of one scale.

    Attributes:
        start: indices of the first one along x, y and z.
        size: how many, along x, y and z.
    """

    start: tuple[int, ...]
    size: tuple[int, ...]

    def grown(self, border: int = BORDER) -> Box:
        """With so many voxels more on each side."""
        return Box(tuple(s - border for s in self.start), tuple(n + 2 * border for n in self.size))

    def coarser(self) -> Box:
        """Voxels of twice the edge that contain all of these."""
        ends = [(s + n - 1) // 2 + 1 for s, n in zip(self.start, self.size, strict=True)]
        start = tuple(s // 2 for s in self.start)
        return Box(start, tuple(e - s for s, e in zip(start, ends, strict=True)))

    def within(self, coarse: Box) -> tuple[slice, slice, slice]:
        """Where these voxels are among those of a coarser box that are split in eight."""
        shifts = [s - 2 * c for s, c in zip(self.start, coarse.start, strict=True)]
        x, y, z = (slice(o, o + n) for o, n in zip(shifts, self.size, strict=True))
        return x, y, z


def needed(box: Box, scales: int) -> Sequence[Box]:
    """The boxes whose features must be known at each scale, from the finest, which is `box`, on."""
    boxes = [box]
    for _ in range(scales - 1):
        boxes.append(boxes[-1].grown().coarser())
    return boxes
