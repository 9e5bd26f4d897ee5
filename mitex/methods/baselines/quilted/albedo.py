"""A flat texture to compare radiance fields with: quilted pictures (Huang et al. 2023, table 2)."""

from __future__ import annotations

import numpy as np

from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.methods.nerf.synthesis.patches import Patches
from mitex.methods.nerf.training.light_estimate import brightness
from mitex.quilting.matching import ArraySource
from mitex.quilting.plane import quilt


def quilted_albedo(
    patches: Patches,
    pictures: np.ndarray,
    size: tuple[int, int],
    rng: np.random.Generator,
    tileable: bool = False,
    evenness: float | None = None,
) -> np.ndarray:
    """An image quilted as latent features are, with colours in their place.

    Args:
        patches: P squares on the base shape.
        pictures: (P, S, S, 3) sRGB in [0, 1], as of `render_patches`, in the order of the patches' texels.
        size: height and width [texels].
        rng: of all choices.
        tileable: the image can be repeated.
        evenness: how much patches are avoided that were used before; as of `quilt`.

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
    return np.clip(quilt(source, size, rng, tileable=tileable, evenness=evenness).features, 0.0, 1.0)


def in_even_light(patches: Patches, pictures: np.ndarray, base: Mesh, light: np.ndarray) -> np.ndarray:
    """Pictures of patches as if the light of the capture were even: every texel divided by its brightness.

    That is what the light gives to a diffuse base shape. Highlights, and shades of what stands up from the
    base shape, stay in the pictures.

    Args:
        patches, pictures: as of `quilted_albedo`.
        base: the shape that the patches lie on.
        light: (16,) spherical harmonics.

    Returns:
        As `pictures`.
    """
    factor = brightness(light, base.face_normals).astype(np.float32)[patches.faces]
    return np.clip(pictures / factor[..., None], 0.0, 1.0)
