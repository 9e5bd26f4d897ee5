"""A texture as a sum of textures, each half as fine as the one before (Hoellein et al. 2022, section 3.1)."""

from __future__ import annotations

from collections.abc import Sequence

import torch
import torch.nn.functional as F

from mitex.features.normalisation import MEAN

FALL = (8.0, 4.0, 2.0)  # of what holds textures near zero, from the finest on; none for coarser ones


def zero_textures(resolution: int, count: int) -> dict[str, torch.Tensor]:
    """Textures (3, R / 2^k, R / 2^k) of zeros, by name."""
    return {f"texture{k}": torch.zeros(3, resolution >> k, resolution >> k) for k in range(count)}


def sum_of(textures: Sequence[torch.Tensor]) -> torch.Tensor:
    """(R, R, 3) sRGB: ImageNet's mean colour and the sum of all, interpolated bilinearly.

    It may leave [0, 1], since only each texture alone is kept in range. If it was clamped, texels that have
    left would get no gradient that brings them back.
    """
    side = textures[0].shape[-1]
    total = textures[0]
    for texture in textures[1:]:
        total = total + F.interpolate(texture[None], size=(side, side), mode="bilinear")[0]
    return total.movedim(0, -1) + total.new_tensor(MEAN)


def within_range(texture: torch.Tensor) -> torch.Tensor:
    """A texture clamped to [0, 1]; its gradients pass as if it was not, so that texels come back."""
    return texture + (texture.clamp(0, 1) - texture).detach()


@torch.no_grad()
def keep_in_range(textures: Sequence[torch.Tensor]) -> None:
    """Clamps each texture (3, s, s), in place, to where it alone gives colours in [0, 1], as published."""
    for texture in textures:
        low = -texture.new_tensor(MEAN)[:, None, None]
        texture.clamp_(low, low + 1)


def fine_energy(textures: Sequence[torch.Tensor]) -> torch.Tensor:
    """Weighted mean squares of the finer textures, which shall show what coarser ones cannot: a scalar.

    Args:
        textures: (3, s, s) each, the finest first.
    """
    return sum((w * t.square().mean() for w, t in zip(FALL, textures, strict=False)), torch.zeros(()))
