"""Texture synthesis by quilting (Efros and Freeman 2001), as NeRF-Texture does it (Huang et al. 2023, section
3.2.2): patches that overlap, one by one.

Of 128 texels of a patch, 48 overlap the neighbour on each side and 32 are the core, so that patches are 80
apart. Everything is generic over a `Source`: latent features and colours are quilted by the same program.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mitex.cuts import cheapest_path, feather, new_part, overlap_paths
from mitex.errors import ConfigError
from mitex.progress import announce
from mitex.quilting.guide import Guide, GuideDistance
from mitex.quilting.matching import FLIPS, SIDES, Matcher, Source, mirror, overlap, strip
from mitex.quilting.repetition import EVENNESS, Repetition

NEAREST = 16  # candidates for a place
Maps = dict[str, np.ndarray]  # the fields of `Quilt`


@dataclass(frozen=True, eq=False)
class Quilt:
    """A synthesized texture and where each texel is from. Row 0 is on top.

    Attributes:
        features: (H, W, C) float32, averaged across seams.
        patch: (H, W) int32 index of the patch.
        flip: (H, W) uint8 how it is mirrored: bit 0, its columns are in reverse order; bit 1, its rows.
        texel: (H, W, 2) int16 row and column in the patch as it was before mirroring.
        angle: (H, W) float32 on a surface: from where the texture's right shall point to the patch's,
            counter-clockwise seen from outside [rad].
    """

    features: np.ndarray
    patch: np.ndarray
    flip: np.ndarray
    texel: np.ndarray
    angle: np.ndarray | float = 0.0

    def look_up(self, values: np.ndarray) -> np.ndarray:
        """What else the patches have per texel, (P, S, S, ...), in the texture: (H, W, ...)."""
        return values[self.patch, self.texel[..., 0], self.texel[..., 1]]


def quilt(
    source: Source,
    size: tuple[int, int],
    rng: np.random.Generator,
    *,
    flips: bool = False,
    tileable: bool = False,
    guide: Guide | None = None,
    nearest: int = NEAREST,
    evenness: float | None = None,
) -> Quilt:
    """Synthesizes a texture.

    Args:
        source: the patches.
        size: height and width [texels]; any.
        rng: of all choices.
        flips: use mirrored patches too; vectors that a user keeps for a patch have to be mirrored along.
        tileable: the last column and row also continue in the first.
        guide: a picture that the texture shall resemble.
        nearest: candidates for a place, among which chance decides; doubled until one is allowed.
        evenness: how much repetition is avoided, see `Repetition`; 0 as published. By default 0 with a
            guide, which may ask for a few patches all over, else `EVENNESS`.

    Raises:
        ConfigError: a number is out of range, the guide does not fit, or the patches cannot be used.
    """
    if min(size) < 1 or nearest < 1:
        raise ConfigError(f"a texture of {size} texels with {nearest} candidates", "use 1 or more of each")
    matcher = Matcher(source, FLIPS if flips else (0,), SIDES if tileable else ("left", "top"))
    canvas = _Canvas(source, size, matcher.shape, tileable)
    if evenness is None:
        evenness = EVENNESS if guide is None else 0.0
    repetition = Repetition(matcher.centres, source.length, evenness)
    guide_distance = None
    if guide is not None:
        guide_distance = GuideDistance(guide, len(matcher.centres), size, canvas.side, tileable)
    for row, top in enumerate(canvas.rows):
        announce("quilting the texture", row, len(canvas.rows))
        for column, left in enumerate(canvas.columns):
            strips = canvas.strips(row, column)
            costs = matcher.distances(strips)
            among = nearest if strips or guide_distance else costs.size
            penalties = repetition.penalties()
            if guide_distance is not None:
                penalties = penalties + guide_distance.differences(top, left, matcher.flips)
            costs = costs + (costs.mean() or 1.0) * penalties
            allowed = matcher.allowed(canvas.neighbours(row, column))
            index, flip = matcher.choose(costs, allowed, rng, among)
            canvas.paste(row, column, index, flip)
            repetition.add(index)
    return canvas.result()


class _Canvas:
    """A texture in the making, which reaches past its lower and right border by what is cropped or wrapped.

    Args:
        source: the patches.
        size: height and width [texels].
        shape: of the patches, (S, S, C).
        tileable: leaves one overlap to be wrapped.
    """

    def __init__(
        self, source: Source, size: tuple[int, int], shape: tuple[int, int, int], tileable: bool
    ) -> None:
        side = shape[0]
        if tileable and min(size) < side:
            raise ConfigError(f"a tileable texture of {size[0]} x {size[1]} texels", f"use at least {side}")
        self.source, self.size, self.side, self.tileable = source, size, side, tileable
        self.rows, self.columns = (_places(length, side, tileable) for length in size)
        self.patch_at: dict[tuple[int, int], int] = {}
        self.texels = np.moveaxis(np.indices((side, side)), 0, -1).astype(np.int16)
        extent = self.rows[-1] + side, self.columns[-1] + side
        self.maps: Maps = {
            "features": np.zeros((*extent, shape[2]), np.float32),
            "patch": np.zeros(extent, np.int32),
            "flip": np.zeros(extent, np.uint8),
            "texel": np.zeros((*extent, 2), np.int16),
        }

    def strips(self, row: int, column: int) -> Maps:
        """What a patch at a place has to continue: by side, the values that are compared."""
        features = self.maps["features"][..., : self.source.matched]
        rows, columns = self._window(row, column)
        strips = {}
        if column:
            strips["left"] = strip(features[rows, columns], "left")
        if row:
            strips["top"] = strip(features[rows, columns], "top")
        if self._wraps(column, self.columns):
            strips["right"] = strip(features[rows, : self.side], "left")
        if self._wraps(row, self.rows):
            strips["bottom"] = strip(features[: self.side, columns], "top")
        return strips

    def neighbours(self, row: int, column: int) -> list[int]:
        """The patches beside a place, across the border too if that is wrapped."""
        beside = [(row, column - 1), (row - 1, column)]
        if self._wraps(column, self.columns):
            beside.append((row, 0))
        if self._wraps(row, self.rows):
            beside.append((0, column))
        return [self.patch_at[place] for place in beside if place in self.patch_at]

    def paste(self, row: int, column: int, index: int, flip: int) -> None:
        """Puts a patch at a place, cut along its left and top side."""
        window, width = self._window(row, column), overlap(self.side)
        new = {
            "features": mirror(self.source.patch(index), flip),
            "patch": np.full((self.side, self.side), index, np.int32),
            "flip": np.full((self.side, self.side), flip, np.uint8),
            "texel": mirror(self.texels, flip),
        }
        old = {name: values[window] for name, values in self.maps.items()}
        error = _difference(old, new, self.source.matched)
        mask = new_part(*overlap_paths(error, width, left=column > 0, top=row > 0))
        weights = feather(mask)
        # Beyond the strips, nothing of what is there is meant to stay.
        weights[width * (row > 0) :, width * (column > 0) :] = 1.0
        _lay(old, new, mask, weights)
        self.patch_at[row, column] = index

    def result(self) -> Quilt:
        """The texture, cropped or wrapped."""
        maps, (height, width) = self.maps, self.size
        if self.tileable:
            maps = _wrap(_transpose(maps), width, overlap(self.side), self.source.matched)
            maps = _wrap(_transpose(maps), height, overlap(self.side), self.source.matched, closed=True)
        return Quilt(**{name: values[:height, :width].copy() for name, values in maps.items()})

    def _window(self, row: int, column: int) -> tuple[slice, slice]:
        top, left = self.rows[row], self.columns[column]
        return slice(top, top + self.side), slice(left, left + self.side)

    def _wraps(self, index: int, places: list[int]) -> bool:
        return self.tileable and index == len(places) - 1


def _places(length: int, side: int, tileable: bool) -> list[int]:
    """Where patches begin along a direction; if wrapped, evenly, and the last ends one overlap late."""
    stride = side - overlap(side)
    if not tileable:
        return list(range(0, max(length - overlap(side), 1), stride))
    return [round(place) for place in np.linspace(0, length - stride, math.ceil(length / stride))]


def _difference(old: Maps, new: Maps, channels: int) -> np.ndarray:
    """(H, W) squared differences of the channels that are compared."""
    return np.square(old["features"][..., :channels] - new["features"][..., :channels]).sum(-1)


def _lay(old: Maps, new: Maps, mask: np.ndarray, weights: np.ndarray) -> None:
    """Lays new maps over the old ones, in place: features by weights, all else by the mask."""
    old["features"] += weights[..., None] * (new["features"] - old["features"])
    for name in ("patch", "flip", "texel"):
        old[name][mask] = new[name][mask]


def _wrap(maps: Maps, length: int, width: int, channels: int, closed: bool = False) -> Maps:
    """Maps of `length` rows, the first of which continue the last; written over the given ones.

    Args:
        maps: (length + width, W, ...) each.
        length: rows that remain.
        width: rows of the overlap, which are cut against the first along one path.
        channels: that are compared.
        closed: the columns are wrapped already.
    """
    new = {name: values[:width] for name, values in maps.items()}
    old = {name: values[length : length + width] for name, values in maps.items()}
    path = cheapest_path(_difference(old, new, channels).T, closed)
    mask = np.arange(width)[:, None] > path
    _lay(old, new, mask, feather(mask, wrapped=closed))
    for name, values in new.items():
        values[:] = old[name]
    return {name: values[:length] for name, values in maps.items()}


def _transpose(maps: Maps) -> Maps:
    return {name: values.swapaxes(0, 1) for name, values in maps.items()}
