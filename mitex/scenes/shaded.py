"""Surfaces as vision-language models see them: on one colour, with a lamp beside each camera."""

from __future__ import annotations

import torch
import torch.nn.functional as F

from mitex.scenes.cameras import Cameras

GREY = 0.5  # sRGB, of a surface without colours
BACKGROUND = 1.0
AMBIENT = 0.4
BESIDE = (-0.6, 0.6)  # of the camera, right and up, where it is 1 away: slopes of all directions show


def lamps(cameras: Cameras) -> torch.Tensor:
    """Unit vectors (K, 3) float32 towards the lamp of each camera, to its upper left."""
    right, up, forward = cameras.axes()
    return F.normalize(torch.from_numpy(BESIDE[0] * right + BESIDE[1] * up - forward).float(), dim=1)


def shading(normals: torch.Tensor, lamp: torch.Tensor) -> torch.Tensor:
    """Factor of sRGB colours, from about `AMBIENT` to 1 where a normal points at the lamp.

    The irradiance of a far lamp up to the second degree of the spherical harmonics, 1/4 + x/2 + 5/32 (3 x^2 -
    1) with x the cosine of the angle (Ramamoorthi & Hanrahan 2001): smooth where a lamp's light would end.

    Args:
        normals: (P, 3) unit.
        lamp: (P, 3) unit, towards the lamp.

    Returns:
        (P, 1).
    """
    x = (normals * lamp).sum(1, keepdim=True)
    return AMBIENT + (1 - AMBIENT) / BRIGHTEST * _irradiance(x)


def pictured(
    colours: torch.Tensor, hit: torch.Tensor, cameras: Cameras, background: float = BACKGROUND
) -> torch.Tensor:
    """Pictures (K, H, W, 3) sRGB.

    Args:
        colours: (P, 1 or 3) where pixels meet the surface.
        hit: (K H W,) bool, which pixels do.
        cameras: K views.
        background: sRGB of the other pixels; white by default.
    """
    picture = colours.new_full((len(hit), 3), background)
    return picture.index_put((hit,), colours.expand(-1, 3)).view(*cameras.shape, 3)


def lamps_of_pixels(cameras: Cameras, hit: torch.Tensor) -> torch.Tensor:
    """(P, 3) towards the lamp of each pixel that meets the surface, `hit` as of `pictured`."""
    return lamps(cameras).to(hit.device).repeat_interleave(cameras.width * cameras.height, 0)[hit]


def _irradiance(x):
    return 0.25 + 0.5 * x + 5 / 32 * (3 * x * x - 1)


BRIGHTEST = _irradiance(1.0)
