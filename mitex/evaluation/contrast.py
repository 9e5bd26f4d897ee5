"""How strong the contrast of a texture is: near by, from texel to texel, and from place to place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from mitex.colour import LUMINANCE
from mitex.errors import ImageError

SQUARE = 16  # side of the squares that are looked at [texels]
QUANTILES = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Contrast:
    """Contrasts of a picture: a blurred copy has less, and so has one whose colours are their mean.

    Attributes:
        local: standard deviations of grey within squares: the 5, 50 and 95 % quantiles over the squares.
        finest: root mean square of what a texel's grey differs by from the mean of the 3 x 3 around it.
        squares: standard deviations of red, green and blue from square to square, of the squares' means.
    """

    local: tuple[float, float, float]
    finest: float
    squares: tuple[float, float, float]


def contrast(image: np.ndarray, mask: np.ndarray | None = None) -> Contrast:
    """The contrasts of a picture.

    Args:
        image: (H, W, 3) sRGB in [0, 1].
        mask: (H, W) bool, which texels count; all if None. Squares that hold others do not count.

    Raises:
        ImageError: The mask is of another size, or there are fewer than two whole squares.
    """
    mask = np.ones(image.shape[:2], bool) if mask is None else mask
    if mask.shape != image.shape[:2]:
        raise ImageError(f"a mask of {mask.shape} for a picture of {image.shape[:2]}", "give one of its size")
    whole = _squares(mask[..., None]).all((1, 2))
    if whole.sum() < 2:
        raise ImageError(
            f"fewer than two squares of {SQUARE} x {SQUARE} texels count", "give a larger picture"
        )
    grey = image.astype(np.float64) @ LUMINANCE
    inside = np.asarray(ndimage.binary_erosion(mask, np.ones((3, 3)), border_value=0), bool)
    difference = np.asarray(grey - ndimage.uniform_filter(grey, 3))[inside]
    deviations = _squares(grey[..., None])[whole].std(1)[:, 0]
    means = _squares(image.astype(np.float64))[whole].mean(1)
    low, middle, high = np.quantile(deviations, QUANTILES)
    red, green, blue = means.std(0)
    return Contrast(
        (float(low), float(middle), float(high)),
        float(np.sqrt(np.square(difference).mean())),
        (float(red), float(green), float(blue)),
    )


def _squares(image: np.ndarray) -> np.ndarray:
    """(N, SQUARE^2, C): the whole squares of a picture (H, W, C), from its corner on."""
    rows, columns = (n // SQUARE for n in image.shape[:2])
    cut = image[: rows * SQUARE, : columns * SQUARE]
    parts = cut.reshape(rows, SQUARE, columns, SQUARE, -1).swapaxes(1, 2)
    return parts.reshape(rows * columns, SQUARE**2, -1)
