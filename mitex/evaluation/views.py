"""Quality of rendered views beside photos that a model has not learned from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mitex.evaluation.metrics import psnr, ssim, vgg_distance


@dataclass(frozen=True)
class ViewQuality:
    """Means over views.

    Attributes:
        psnr: peak signal-to-noise ratio [dB].
        ssim: structural similarity.
        vgg: `vgg_distance`, which takes the place of LPIPS.
    """

    psnr: float
    ssim: float
    vgg: float

    def __str__(self) -> str:
        return f"PSNR {self.psnr:.2f} dB, SSIM {self.ssim:.3f}, VGG distance {self.vgg:.3f}"


def view_quality(views: Iterable[tuple[np.ndarray, np.ndarray]]) -> ViewQuality:
    """Compares renderings with photos.

    Args:
        views: at least one (rendering, photo), (H, W, 3) float32 sRGB in [0, 1] each, on the same background.

    Raises:
        ImageError: as in `psnr`.
    """
    measures = [(psnr(a, b), ssim(a, b), vgg_distance(a, b)) for a, b in views]
    return ViewQuality(*(float(x) for x in np.mean(measures, axis=0)))
