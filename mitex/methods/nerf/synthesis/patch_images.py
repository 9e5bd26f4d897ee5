"""Pictures of patches of a captured surface from above: for guides, and for flat textures."""

from __future__ import annotations

import numpy as np

from mitex.methods.nerf.field.rendering import render_rays
from mitex.methods.nerf.field.shell import Shell
from mitex.methods.nerf.synthesis.patches import Patches

OPACITY = 0.05  # pictures of less opaque rays are darkened


def render_patches(shell: Shell, patches: Patches, every: int = 1) -> np.ndarray:
    """Pictures of patches, along the normals of their planes.

    Args:
        shell: the captured texture.
        patches: P squares of S x S texels on its base shape.
        every: texels for which there is one pixel, in each direction; divides S.

    Returns:
        (P, S / every, S / every, 3) float32 sRGB in [0, 1].
    """
    points = patches.points[:, every // 2 :: every, every // 2 :: every]
    z = np.broadcast_to(patches.frames[:, None, None, 2], points.shape)
    origins = (points + 2 * shell.thickness * z).reshape(-1, 3)
    colour, transmittance = render_rays(shell, origins, -z.reshape(-1, 3), far=4 * shell.thickness)
    colour /= np.maximum(1 - transmittance, OPACITY)[:, None]
    return colour.clip(0, 1).reshape(points.shape)
