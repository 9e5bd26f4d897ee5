"""A synthesis that starts from patches of the exemplar, joined on the surface.

What a network sees of a pattern leaves much of it open: from noise, rare colours get lost, stones are all of
one kind, and lines break off. Quilting (Efros and Freeman 2001) keeps what a patch shows, and breaks where
patches do not fit. So patches are laid first, and the synthesis mends what lies between them.
"""

from __future__ import annotations

import numpy as np

from mitex.atlas import spread
from mitex.exemplar import Exemplar
from mitex.geometry.normal_maps import rotated
from mitex.methods.surface.config import SurfaceConfig
from mitex.methods.surface.domain import SurfaceDomain
from mitex.progress import announce
from mitex.quilting.matching import BLOCK
from mitex.quilting.picture import PictureSource
from mitex.quilting.surface import quilt_on
from mitex.triples import Layout

PLACES = 40  # that patches are taken from, along a side of the exemplar, about
STEP = 2 * BLOCK  # sides of patches are multiples of it [px]


def patch_side(share: float, exemplar: int, texture: int) -> int:
    """Side of the patches [px]: so much of the exemplar's, as quilting takes them, at most the texture's.

    Args:
        share: of the exemplar's side, in (0, 1].
        exemplar: its side, at least 8 [px].
        texture: its side; textures of less than 8 texels lie under one patch [texels].
    """
    most = STEP * (min(exemplar, max(texture, STEP)) // STEP)
    return min(max(STEP * round(share * exemplar / STEP), STEP), most)


def joined_patches(
    exemplar: Exemplar, layout: Layout, domain: SurfaceDomain, config: SurfaceConfig
) -> np.ndarray:
    """(N, C) float32 in [0, 1] at the texels: patches of the exemplar, laid over the surface.

    Args:
        exemplar: a pixel of it becomes a texel.
        layout: the exemplar's maps, and their channels at the texels.
        domain: N texels.
        config: `patch`, the size of the pattern, and the seed of all choices.
    """
    announce("joining patches of the exemplar on the surface")
    side = domain.exemplar_side(config)
    images = exemplar.resized(side).maps
    image = np.concatenate([images[name].reshape(side, side, -1) for name in layout], axis=2)
    size = patch_side(config.patch, side, config.resolution)
    source = PictureSource(image.astype(np.float32), size, max((side - size) // PLACES, 1))
    rng = np.random.default_rng(config.seed)
    quilt = quilt_on(source, domain.target(size), rng, interpolated=False)
    if "normal" in layout:  # in the patches' frames, which are not quite the texels'
        normal = list(layout["normal"])
        quilt.features[..., normal] = rotated(quilt.features[..., normal], quilt.angle)
    texture = spread(quilt.features, quilt.patch >= 0, config.resolution)
    return texture.reshape(-1, image.shape[2])[domain.texels.index].clip(0.0, 1.0)
