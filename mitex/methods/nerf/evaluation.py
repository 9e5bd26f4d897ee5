"""How well held-out views are seen, and how real a synthesized texture looks (sections 4.2 and 4.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.methods.nerf.capture import Capture
from mitex.methods.nerf.pixels import Pixels
from mitex.methods.nerf.radiance import look
from mitex.metrics import psnr, ssim, vgg_distance
from mitex.textures.march import RadianceField


@dataclass(frozen=True)
class ViewQuality:
    """Means over views, on white.

    Attributes:
        psnr: [dB].
        ssim: structural similarity.
        vgg: `mitex.metrics.vgg_distance`, which takes the place of LPIPS.
    """

    psnr: float
    ssim: float
    vgg: float

    def __str__(self) -> str:
        return f"PSNR {self.psnr:.2f} dB, SSIM {self.ssim:.3f}, VGG distance {self.vgg:.3f}"


def view_quality(field: RadianceField, views: Capture, longest: int = 400) -> ViewQuality:
    """Compares a field with photos that it has not seen.

    Args:
        field: in the scene cube of the capture.
        views: held out, see `Capture.split`.
        longest: side that photos are thinned out to [pixels].
    """
    found = []
    for view in range(len(views)):
        seen, photo = view_pair(field, views, view, longest)
        found.append((psnr(seen, photo), ssim(seen, photo), vgg_distance(seen, photo)))
    return ViewQuality(*(float(x) for x in np.mean(found, axis=0)))


def view_pair(
    field: RadianceField, views: Capture, view: int, longest: int = 400
) -> tuple[np.ndarray, np.ndarray]:
    """A view of the field and its photo, (H, W, 3) on white."""
    batch, shape = Pixels(views).image(view, longest)
    photo = (batch.colours * batch.alpha + 1 - batch.alpha).numpy()
    return look(field, batch).reshape(*shape, 3), photo.reshape(*shape, 3)
