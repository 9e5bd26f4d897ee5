"""Constrained synthesis: a picture that a texture resembles from afar, by the choice of its patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.vectors import scatter_add
from mitex.images import resize
from mitex.quilting.matching import mirror

WEIGHT = 5.0


@dataclass(frozen=True, eq=False)
class Guide:
    """A picture that a texture shall resemble.

    Attributes:
        image: (H, W, 3) sRGB in [0, 1], stretched over the texture.
        colours: (P, G, G, 3) sRGB in [0, 1], what the patches look like: means of G x G blocks of texels.
        weight: a colour difference of 1 counts as much as `weight` times the mean distance of all patches.

    Raises:
        ConfigError: an array has the wrong shape or is not finite, or the weight is negative.
    """

    image: np.ndarray
    colours: np.ndarray
    weight: float = WEIGHT

    def __post_init__(self) -> None:
        image, colours = checked_picture(self.image), np.asarray(self.colours, np.float32)
        square = colours.ndim == 4 and colours.shape[1] == colours.shape[2] and colours.shape[3] == 3
        if not square or not colours.size or not np.isfinite(colours).all():
            raise ConfigError(f"patch colours of shape {colours.shape}", "give finite (P, G, G, 3) ones")
        if not self.weight >= 0.0:
            raise ConfigError(f"a guide of weight {self.weight:g}", "use 0 or more")
        object.__setattr__(self, "image", image)
        object.__setattr__(self, "colours", colours)


def checked_picture(picture: np.ndarray) -> np.ndarray:
    """A guide's picture (H, W, 3) as float32; raises a ConfigError for other shapes and NaN."""
    image = np.asarray(picture, np.float32)
    if image.ndim != 3 or image.shape[2] != 3 or not image.size or not np.isfinite(image).all():
        raise ConfigError(f"a guide of shape {image.shape}", "give a finite (H, W, 3) image")
    return image


class GuideDistance:
    """How far patches are from a guide at the places of a texture.

    Args:
        guide: the picture and the patches' colours.
        count: of patches.
        size: height and width of the texture [texels].
        patch: side of a patch [texels].
        wrapped: what reaches past the border lies on the other side; else it has the border's colour.

    Raises:
        ConfigError: the colours do not fit the patches.
    """

    def __init__(self, guide: Guide, count: int, size: tuple[int, int], patch: int, wrapped: bool) -> None:
        self.cells = _cells(guide, count, patch)
        self.patch, self.weight = patch, guide.weight
        self.colours = guide.colours.reshape(count, -1)
        beyond = (0, patch), (0, patch), (0, 0)
        self.image = np.pad(resize(guide.image, *size), beyond, mode="wrap" if wrapped else "edge")

    def differences(self, top: int, left: int, flips: Sequence[int]) -> np.ndarray:
        """(flips, P) weight times the root mean square of the colour differences at a place."""
        below = self.image[top : top + self.patch, left : left + self.patch]
        block = self.patch // self.cells
        means = below.reshape(self.cells, block, self.cells, block, 3).mean((1, 3))
        target = np.stack([mirror(means, flip).ravel() for flip in flips])
        return self.weight * np.sqrt(np.square(self.colours - target[:, None]).mean(2))


class SurfaceGuide:
    """A picture that a texture on a surface shall resemble, for `mitex.quilting.surface.quilt_on`.

    Args:
        texels: (N, 3) sRGB in [0, 1], its colours at the target's texels.
        colours: (P, G, G, 3) and
        weight: as of `Guide`.
        patch: side of a patch [texels], which G divides.

    Raises:
        ConfigError: as of `Guide`, or blocks that do not divide a patch.
    """

    def __init__(self, texels: np.ndarray, colours: np.ndarray, patch: int, weight: float = WEIGHT) -> None:
        guide = Guide(texels[None], colours, weight)
        self.count, self.patch, self.weight = len(guide.colours), patch, weight
        self.cells = _cells(guide, self.count, patch)
        self.texels, self.colours = guide.image[0], guide.colours.reshape(self.count, -1, 3)

    def differences(self, texels: np.ndarray, where: np.ndarray) -> np.ndarray:
        """(P,) weight times the root mean square of the colour differences, over blocks that hold texels.

        Args:
            texels: (M,) that a patch is going to cover.
            where: (M, 2) their columns and rows in the patch.
        """
        block = self.patch // self.cells
        column, row = np.clip(np.rint(where).astype(np.int64) // block, 0, self.cells - 1).T
        number = row * self.cells + column
        counts = np.bincount(number, minlength=self.cells**2)
        sums = scatter_add(number, self.texels[texels], self.cells**2)
        held = counts > 0
        means = sums[held] / counts[held, None]
        return self.weight * np.sqrt(np.square(self.colours[:, held] - means).mean((1, 2)))


def _cells(guide: Guide, count: int, patch: int) -> int:
    """Blocks along the side of a patch, if the guide's colours are of as many patches, and fit them."""
    colours, cells = guide.colours.shape[:2]
    if colours != count or patch % cells:
        raise ConfigError(
            f"a guide with colours of {colours} patches in {cells} x {cells} blocks",
            f"give those of all {count}, in a number of blocks that divides {patch} texels",
        )
    return cells
