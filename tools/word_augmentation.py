"""Changes of pictures that leave true what is said about them."""

from __future__ import annotations

import torch
import torch.nn.functional as F


def augmented(images: torch.Tensor, side: int, generator: torch.Generator) -> torch.Tensor:
    """Random pieces, mirrored, of other brightness, contrast and tint, blurred and noisy.

    Args:
        images: (B, 3, S, S) sRGB in [0, 1].
        side: of the pieces, from `side / S` to 1 of the picture wide.

    Returns:
        (B, 3, side, side) in [0, 1].
    """

    def uniform(low: float, high: float, channels: int = 1) -> torch.Tensor:
        return low + (high - low) * torch.rand(len(images), channels, 1, 1, generator=generator)

    pieces = _pieces(images, side, generator)
    pieces = pieces.clamp(1e-3, 1) ** uniform(0.8, 1.25) * uniform(0.85, 1.15) * uniform(0.96, 1.04, 3)
    pieces = torch.lerp(pieces, F.avg_pool2d(pieces, 3, 1, 1, count_include_pad=False), _often(uniform, 0.4))
    coarse = torch.randn(len(images), 3, side // 8, side // 8, generator=generator)
    coarse = F.interpolate(coarse, size=side, mode="bilinear", align_corners=False)
    fine = torch.randn(pieces.shape, generator=generator)
    return (pieces + _often(uniform, 0.5) * 0.06 * fine + _often(uniform, 0.3) * 0.06 * coarse).clamp(0, 1)


def _often(uniform, share: float) -> torch.Tensor:
    """A random strength in [0, 1] for this share of the pictures, none for the others."""
    return uniform(0, 1) * (uniform(0, 1) < share)


def _pieces(images: torch.Tensor, side: int, generator: torch.Generator) -> torch.Tensor:
    count = len(images)
    part = side / images.shape[-1]
    scale = part + (1 - part) * torch.rand(count, generator=generator)
    shift = (1 - scale) * (2 * torch.rand(2, count, generator=generator) - 1)
    mirrored = torch.randint(2, (2, count), generator=generator) * 2 - 1
    none = torch.zeros(count)
    rows = [scale * mirrored[0], none, shift[0], none, scale * mirrored[1], shift[1]]
    grid = F.affine_grid(torch.stack(rows, 1).view(count, 2, 3), [count, 3, side, side], align_corners=False)
    return F.grid_sample(images, grid, padding_mode="border", align_corners=False)
