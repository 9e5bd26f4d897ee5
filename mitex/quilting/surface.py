"""Quilting on a surface: patches are laid around its points, so that charts play no part.

The patch for a place is chosen as in the plane (`mitex.quilting.plane`), by what it has to continue, here of
any outline, in blocks of texels. It is joined along the cheapest cut of any form (Kwatra et al. 2003).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation, binary_erosion

from mitex.cuts import cheapest_cut, feather
from mitex.errors import ConfigError
from mitex.geometry.vectors import scatter_add
from mitex.progress import announce
from mitex.quilting.block_matching import BlockMatcher, block_means
from mitex.quilting.guide import SurfaceGuide
from mitex.quilting.matching import BLOCK, Source
from mitex.quilting.plane import NEAREST, Quilt
from mitex.quilting.repetition import EVENNESS, Repetition
from mitex.quilting.target import Target

FINE_CELL = 2  # side of the cells that a cut goes between, where texels are so fine [texels of a patch]
FINE_TEXELS = 2.0  # area of a texel [texels of a patch] up to which nearly each such cell has one
OUTWARD = 3 / 16  # by which a patch's middle is moved away from what is there; half less an overlap [sides]
ENLARGED = 1.1  # size of a patch above which its values are always interpolated
MARGIN = 2  # cells between a cut and what was empty, over which the seam is averaged


def quilt_on(
    source: Source,
    target: Target,
    rng: np.random.Generator,
    *,
    nearest: int = NEAREST,
    evenness: float | None = None,
    interpolated: bool = True,
    guide: SurfaceGuide | None = None,
) -> Quilt:
    """Synthesizes a texture on a surface.

    Args:
        source: the patches, of the target's size.
        target: the surface.
        rng: of all choices.
        nearest: candidates for a place, among which chance decides; doubled until one is allowed.
        evenness: how much repetition is avoided, see `Repetition`; None: nothing with a guide, which may ask
            for a few patches all over, else `EVENNESS`.
        interpolated: values lie between those of a patch's texels, which takes fine grain from pictures;
            instead of being the nearest ones, unless a patch is enlarged: these would be blocks then.
        guide: a picture that the texture shall resemble.

    Returns:
        The texture in the target's map.

    Raises:
        ConfigError: a number is out of range, the guide is of other patches, or these cannot be used.
    """
    if evenness is None:
        evenness = EVENNESS if guide is None else 0.0
    if nearest < 1:
        raise ConfigError(f"{nearest} candidates", "use 1 or more")
    matcher = BlockMatcher(source)
    if guide is not None and guide.count != len(matcher.centres):
        raise ConfigError(
            f"a guide of {guide.count} patches for {len(matcher.centres)}", "give the colours of all of them"
        )
    repetition = Repetition(matcher.centres, source.length, evenness)
    canvas = _Canvas(source, target, matcher.shape, interpolated)
    for texel in canvas.empty():
        place = canvas.beside(texel)
        costs = matcher.distances(*place.blocks())
        penalties = repetition.penalties()
        if guide is not None:
            penalties = penalties + guide.differences(place.texels, place.where)
        costs = costs + (costs.mean() or 1.0) * penalties
        allowed = matcher.allowed(canvas.neighbours(place))
        among = nearest if guide is not None or place.known.any() else costs.size
        index, _ = matcher.choose(costs[None], allowed, rng, among)
        canvas.paste(place, index)
        repetition.add(index)
    return canvas.result()


@dataclass(frozen=True, eq=False)
class _Place:
    """What a patch is going to cover, M texels.

    Attributes:
        texels: (M,).
        where: (M, 2) column and row in the patch.
        angle: (M,) from where the texture's right shall point to the patch's [rad].
        interpolated: whether a patch's values are interpolated there.
        known: (M,) bool, which have values already.
        cell: side of the cells [texels of a patch].
        counts: (G, G) texels in the cells; those that have values:
        filled: (G, G), and
        sums: (G, G, C) of their values, in the channels that are compared.
    """

    texels: np.ndarray
    where: np.ndarray
    angle: np.ndarray
    interpolated: bool
    known: np.ndarray
    cell: int
    counts: np.ndarray
    filled: np.ndarray
    sums: np.ndarray

    def blocks(self) -> tuple[np.ndarray, np.ndarray]:
        """How much of the blocks is there, and their means, for `BlockMatcher.distances`."""
        size = BLOCK // self.cell
        counts, filled = (block_means(n[..., None], size)[..., 0] for n in (self.counts, self.filled))
        values = block_means(self.sums, size) / np.where(filled, filled, 1)[..., None]
        return filled / np.where(counts, counts, 1), values

    def new_cells(self, patch: np.ndarray) -> np.ndarray:
        """(G, G) bool, where a patch (S, S, C) takes the place of what is there."""
        old = self.sums / np.where(self.filled, self.filled, 1)[..., None]
        new = block_means(patch[..., : old.shape[2]], self.cell)
        error = np.where(self.filled, np.square(old - new).sum(-1), 0.0)
        empty = self.counts > self.filled
        there = np.asarray(binary_closing(np.pad(self.counts > 0, 1))[1:-1, 1:-1], bool)
        inner: np.ndarray = np.asarray(binary_erosion(there), bool)
        rim = there & ~inner & (self.filled > 0)
        return cheapest_cut(
            error, rim, empty | (np.asarray(binary_dilation(empty, iterations=MARGIN), bool) & ~rim)
        )


class _Canvas:
    """A texture in the making on a surface of N texels."""

    def __init__(
        self, source: Source, target: Target, shape: tuple[int, int, int], interpolated: bool
    ) -> None:
        self.source, self.target, self.side, self.interpolated = source, target, shape[0], interpolated
        self.cell = FINE_CELL if target.area < FINE_TEXELS else BLOCK
        count = target.count
        self.features = np.zeros((count, shape[2]), np.float32)
        self.patch = np.full(count, -1, np.int32)
        self.texel = np.zeros((count, 2), np.int16)
        self.angle = np.zeros(count, np.float32)

    def empty(self) -> Iterator[int]:
        """Texels without a value, until there are none."""
        order = self.target.in_order()
        start = 0
        while start < len(order):
            missing = self.patch[order[start : start + 4096]] < 0
            if not missing.any():
                start += len(missing)
                continue
            start += int(missing.argmax())
            announce("quilting the surface", int((self.patch >= 0).sum()), len(order))
            yield int(order[start])

    def beside(self, texel: int) -> _Place:
        """What a patch covers with this empty texel in it, moved away from what is there."""
        place = self.around(texel)
        if not place.known.any():
            return place
        empty, where = place.texels[~place.known], place.where[~place.known]
        away = where.mean(0) - 0.5 * (self.side - 1)
        goal = 0.5 * (self.side - 1) + OUTWARD * self.side * away / max(float(np.abs(away).max()), 1.0)
        farther = self.around(int(empty[np.square(where - goal).sum(1).argmin()]))
        return farther if texel in farther.texels else place

    def around(self, texel: int) -> _Place:
        """What a patch covers whose middle is there."""
        texels, where, angle = self.target.around(texel)
        known = self.patch[texels] >= 0
        cells = self.side // self.cell
        column, row = np.clip(np.rint(where).astype(np.int64) // self.cell, 0, cells - 1).T
        number = row * cells + column
        values = self.features[texels[known], : self.source.matched]
        counts, filled = (np.bincount(n, minlength=cells**2) for n in (number, number[known]))
        sums = scatter_add(number[known], values, cells**2)
        shape, sizes = (cells, cells), self.target.sizes
        return _Place(
            texels,
            where,
            angle,
            self.interpolated or (sizes is not None and sizes[texel] > ENLARGED),
            known,
            self.cell,
            counts.reshape(shape),
            filled.reshape(shape),
            sums.reshape(*shape, -1),
        )

    def neighbours(self, place: _Place) -> np.ndarray:
        """The patches beside a place."""
        return np.unique(self.patch[place.texels[place.known]])

    def paste(self, place: _Place, index: int) -> None:
        """Lays a patch there: all of it where nothing was, elsewhere up to the cheapest cut."""
        patch = self.source.patch(index)
        new = place.new_cells(patch)
        share = feather(np.kron(new, np.ones((self.cell,) * 2, bool)))
        column, row = np.clip(np.rint(place.where).astype(np.int16), 0, self.side - 1).T
        weights = np.where(place.known, share[row, column], 1.0)[:, None]
        values, sampled = self.features[place.texels], _between if place.interpolated else _nearest
        self.features[place.texels] = values + weights * (sampled(patch, place.where) - values)
        shown = weights[:, 0] > 0.5
        self.patch[place.texels[shown]] = index
        self.texel[place.texels[shown]] = np.stack([row, column], axis=1)[shown]
        self.angle[place.texels[shown]] = place.angle[shown]

    def result(self) -> Quilt:
        """The texture in the map."""
        kept = self.features, self.patch, self.texel, self.angle
        features, patch, texel, angle = (self.target.map(values) for values in kept)
        return Quilt(features, patch, np.zeros(patch.shape, np.uint8), texel, angle)


def _nearest(patch: np.ndarray, where: np.ndarray) -> np.ndarray:
    """(M, C) of the texels of a patch (S, S, C) that are nearest to columns and rows (M, 2)."""
    column, row = np.clip(np.rint(where).astype(np.int64), 0, len(patch) - 1).T
    return patch[row, column]


def _between(patch: np.ndarray, where: np.ndarray) -> np.ndarray:
    """(M, C) of a patch (S, S, C) at columns and rows (M, 2), bilinear; its border goes on beyond it."""
    last = len(patch) - 1
    where = np.clip(where, 0, last)
    low = np.minimum(where.astype(np.int64), last - 1)
    across, down = (where - low).astype(np.float32).T[..., None]
    column, row = low.T
    top = patch[row, column] + across * (patch[row, column + 1] - patch[row, column])
    below = patch[row + 1, column] + across * (patch[row + 1, column + 1] - patch[row + 1, column])
    return top + down * (below - top)
