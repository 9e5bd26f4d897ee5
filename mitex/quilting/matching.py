"""Which patch continues a texture: candidates by their strips, and a random choice among the nearest.

A square is compared by its overlap strips, in which blocks of texels along the strip are summed. That leaves
24,576 numbers for a strip of 16 channels. In so many dimensions no search tree helps, so all distances are
computed, by one matrix product. Mirrored patches need no strips of their own: the place is mirrored instead.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mitex.errors import ConfigError

BLOCK = 4  # texels summed along a strip
APART = 0.2  # sources of neighbours are at least so far apart [sides of a patch]
SHARPNESS = 3  # p ~ (1 - d / d_max)^3
HORIZONTAL, VERTICAL = 1, 2  # bits of a flip: columns, rows in reverse order
FLIPS = (0, HORIZONTAL, VERTICAL, HORIZONTAL | VERTICAL)
SIDES = ("left", "top", "right", "bottom")
_OPPOSITE = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}


class Source(Protocol):
    """P square patches with C values per texel; row 0 is on top.

    Attributes:
        centres: (P, D) where they were taken.
        length: side of a patch in the units of `centres`.
        matched: how many of the channels, the first ones, are compared.
    """

    @property
    def centres(self) -> np.ndarray: ...

    @property
    def length(self) -> float: ...

    @property
    def matched(self) -> int: ...

    def patch(self, index: int) -> np.ndarray:
        """(S, S, C) float32 values of a patch, S a multiple of 8."""
        ...


@dataclass(frozen=True, eq=False)
class ArraySource:
    """Patches that lie in memory.

    Attributes:
        values: (P, S, S, C).
        centres, length: see `Source`.
        channels: that are compared; all if None.
    """

    values: np.ndarray
    centres: np.ndarray
    length: float
    channels: int | None = None

    @property
    def matched(self) -> int:
        return self.values.shape[-1] if self.channels is None else self.channels

    def patch(self, index: int) -> np.ndarray:
        return self.values[index]


def mirror(square: np.ndarray, flip: int) -> np.ndarray:
    """An array (H, W, ...) with its columns, its rows or both in reverse order."""
    return square[:: -1 if flip & VERTICAL else 1, :: -1 if flip & HORIZONTAL else 1]


def overlap(size: int) -> int:
    """Width of the strips of a square of side `size`: 48 of 128."""
    return 3 * size // 8


def strip(square: np.ndarray, side: str) -> np.ndarray:
    """The overlap strip of a square (S, S, C) along a side, its texels in place."""
    width = overlap(len(square))
    rows = {"top": slice(None, width), "bottom": slice(-width, None)}.get(side, slice(None))
    columns = {"left": slice(None, width), "right": slice(-width, None)}.get(side, slice(None))
    return square[rows, columns]


class Candidates:
    """The patches among which one is drawn for a place.

    Args:
        source: at least one patch.
        flips: that they may have, of `FLIPS`.

    Raises:
        ConfigError: there are no patches, or they have an unfit shape.
    """

    def __init__(self, source: Source, flips: Iterable[int] = (0,)) -> None:
        if not len(source.centres):
            raise ConfigError("no patches to make a texture of", "extract some first")
        self.flips, self.centres = tuple(flips), np.asarray(source.centres, np.float64)
        self.apart = APART * source.length
        self.shape = _checked_shape(source)

    def allowed(self, neighbours: Iterable[int]) -> np.ndarray:
        """(P,) bool, the patches that do not repeat what is beside the place.

        Those are taken from elsewhere than the neighbours; if there are none, they are other patches; if
        there are none either, any.
        """
        far, other = (np.ones(len(self.centres), bool) for _ in range(2))
        for index in neighbours:
            far &= np.linalg.norm(self.centres - self.centres[index], axis=1) >= self.apart
            other[index] = False
        far &= other
        return next((mask for mask in (far, other) if mask.any()), np.ones_like(far))

    def choose(
        self, costs: np.ndarray, allowed: np.ndarray, rng: np.random.Generator, nearest: int
    ) -> tuple[int, int]:
        """A patch and its flip, by chance among the nearest.

        Args:
            costs: (flips, P).
            allowed: (P,) bool, at least one.
            rng: of the choice.
            nearest: how many candidates are looked at; doubled until one of them is allowed.
        """
        flat = costs.ravel()
        order = np.argsort(flat, kind="stable")
        candidates = allowed[order % len(allowed)]
        while not candidates[:nearest].any():
            nearest *= 2
        near = order[:nearest]
        chances = 1.0 - flat[near] / max(float(flat[near[-1]]), np.finfo(np.float32).tiny)
        weights = np.where(candidates[:nearest], chances.astype(np.float64) ** SHARPNESS, 0.0)
        if not weights.any():  # the farthest alone is allowed, or all are as far
            weights = candidates[:nearest].astype(np.float64)
        row, index = divmod(int(rng.choice(near, p=weights / weights.sum())), len(allowed))
        return index, self.flips[row]


class Matcher(Candidates):
    """Compares places in a texture with all patches.

    Args:
        source: at least one patch.
        flips: that candidates may have, of `FLIPS`.
        sides: that places will be compared by.

    Raises:
        ConfigError: there are no patches, they have an unfit shape, or a value is not finite.
    """

    def __init__(self, source: Source, flips: Iterable[int], sides: Iterable[str]) -> None:
        super().__init__(source, flips)
        count = len(source.centres)
        source_sides = {_source_side(name, flip) for name in sides for flip in self.flips}
        side = self.shape[0]
        length = side // BLOCK * overlap(side) * source.matched
        self._strips = {name: np.empty((count, length), np.float32) for name in source_sides}
        for index in range(count):
            square = source.patch(index)[..., : source.matched]
            for name, rows in self._strips.items():
                rows[index] = _block_sums(strip(square, name), name)
        # |a - b|^2 = |a|^2 - 2 a b + |b|^2 loses the fewest digits around the mean.
        self._means = {name: rows.mean(0) for name, rows in self._strips.items()}
        self._squares = {name: centre(rows, self._means[name]) for name, rows in self._strips.items()}

    def distances(self, strips: Mapping[str, np.ndarray]) -> np.ndarray:
        """(flips, P) L2 distances to the strips around a place; where two meet, texels count twice."""
        total = np.zeros((len(self.flips), len(self.centres)), np.float32)
        for row, flip in enumerate(self.flips):
            for side, values in strips.items():
                own = _source_side(side, flip)
                target = _block_sums(mirror(values, flip), own) - self._means[own]
                total[row] += self._squares[own] - 2.0 * (self._strips[own] @ target) + target @ target
        return np.sqrt(np.maximum(total, 0.0))


def _source_side(side: str, flip: int) -> str:
    """Which side of an unmirrored patch lies at a side of its mirror image."""
    reversed_ = flip & (HORIZONTAL if side in ("left", "right") else VERTICAL)
    return _OPPOSITE[side] if reversed_ else side


def _block_sums(values: np.ndarray, side: str) -> np.ndarray:
    """The numbers that a strip is compared by."""
    along = values if side in ("left", "right") else values.swapaxes(0, 1)
    return along.reshape(-1, BLOCK, *along.shape[1:]).sum(1).ravel()


def centre(rows: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """(P,) squared lengths of the rows (P, K), from which the mean is taken off in place."""
    rows -= mean
    squares = np.einsum("pk,pk->p", rows, rows)
    if not np.isfinite(squares).all():
        raise ConfigError("the patches have NaN or infinite values", "check what they are made of")
    return squares


def _checked_shape(source: Source) -> tuple[int, int, int]:
    """(S, S, C) of the patches."""
    shape = source.patch(0).shape
    if len(shape) != 3 or shape[0] != shape[1] or shape[0] % 8 or not shape[0]:
        raise ConfigError(f"patches of shape {shape}", "give squares whose side is a multiple of 8 texels")
    if not 0 < source.matched <= shape[2]:
        raise ConfigError(
            f"{source.matched} of {shape[2]} channels to compare", f"use 1 to {shape[2]} channels"
        )
    return shape
