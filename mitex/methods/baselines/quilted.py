"""A flat texture to compare radiance fields with: quilted pictures (Huang et al. 2023, table 2)."""

from __future__ import annotations

import numpy as np

from mitex.errors import ConfigError
from mitex.methods.nerf.synthesis.matching import ArraySource
from mitex.methods.nerf.synthesis.patches import Patches
from mitex.methods.nerf.synthesis.quilting import quilt


def quilted_albedo(
    patches: Patches,
    pictures: np.ndarray,
    size: tuple[int, int],
    rng: np.random.Generator,
    tileable: bool = False,
) -> np.ndarray:
    """An image quilted as latent features are, as published (no evenness), with colours in their place.

    Args:
        patches: P squares on the base shape.
        pictures: (P, S, S, 3) sRGB in [0, 1], as of `render_patches`, in the order of the patches' texels.
        size: height and width [texels].
        rng: of all choices.
        tileable: the image can be repeated.

    Returns:
        (height, width, 3) float32 sRGB in [0, 1], row 0 on top.

    Raises:
        ConfigError: the pictures do not fit the patches or are not finite, or the size is out of range.
    """
    pictures = np.asarray(pictures, np.float32)
    expected = (*patches.faces.shape, 3)
    if pictures.shape != expected:
        raise ConfigError(f"pictures of patches of shape {pictures.shape}", f"render {expected}")
    source = ArraySource(pictures, patches.centres, patches.length)
    return np.clip(quilt(source, size, rng, tileable=tileable, evenness=0.0).features, 0.0, 1.0)
