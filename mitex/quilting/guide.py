"""Constrained synthesis: a picture that a texture resembles from afar, by the choice of its patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mitex.errors import ConfigError
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
        image, colours = (np.asarray(a, np.float32) for a in (self.image, self.colours))
        if image.ndim != 3 or image.shape[2] != 3 or not image.size or not np.isfinite(image).all():
            raise ConfigError(f"a guide of shape {image.shape}", "give a finite (H, W, 3) image")
        square = colours.ndim == 4 and colours.shape[1] == colours.shape[2] and colours.shape[3] == 3
        if not square or not colours.size or not np.isfinite(colours).all():
            raise ConfigError(f"patch colours of shape {colours.shape}", "give finite (P, G, G, 3) ones")
        if not self.weight >= 0.0:
            raise ConfigError(f"a guide of weight {self.weight:g}", "use 0 or more")
        object.__setattr__(self, "image", image)
        object.__setattr__(self, "colours", colours)


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
        colours, self.cells = guide.colours.shape[:2]
        if colours != count or patch % self.cells:
            raise ConfigError(
                f"a guide with colours of {colours} patches in {self.cells} x {self.cells} blocks",
                f"give those of all {count}, in a number of blocks that divides {patch} texels",
            )
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
