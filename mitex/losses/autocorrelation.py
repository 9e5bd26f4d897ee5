"""Autocorrelation of feature maps: how a pattern repeats."""

from __future__ import annotations

import torch


def autocorrelation(maps: torch.Tensor, mask: torch.Tensor | None = None) -> torch.Tensor:
    """How maps (K, h, w, C) resemble themselves at each shift, (K, 2 h, w + 1), 1 without a shift.

    Products of features minus their means, summed over channels and over all places that both copies cover,
    and divided by the number of places: what a larger piece of the same pattern would give, in expectation.
    Shifts of (dy, dx) are in row dy (negative ones from the end) and column dx >= 0.

    Args:
        maps: the maps.
        mask: (h, w), 1 at the places that count and 0 at others; all do if None.
    """
    height, width = maps.shape[1:3]
    size = (2 * height, 2 * width)
    mask = maps.new_ones(height, width) if mask is None else mask
    weight = (mask / mask.sum())[:, :, None]
    centred = ((maps - (maps * weight).sum((1, 2), keepdim=True)) * mask[:, :, None]).permute(0, 3, 1, 2)
    power = torch.fft.rfft2(centred, s=size).abs().square().sum(1)
    products = torch.fft.irfft2(power, s=size)
    covered = torch.fft.irfft2(torch.fft.rfft2(mask, s=size).abs().square(), s=size).clamp(min=1.0)
    means = (products / covered)[..., : width + 1]
    return means / means[:, :1, :1].clamp(min=1e-8)


def autocorrelation_distance(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Mean absolute difference (K,) of the autocorrelations of maps (K, h, w, C) and (K, h', w', C).

    Over shifts of up to half the smaller maps' sides; beyond, few places are left (Cells2Pixels, section
    3.3).
    """
    height, width = (min(m, n) // 2 for m, n in zip(a.shape[1:3], b.shape[1:3], strict=True))
    shifts = [
        torch.cat([c[:, : height + 1], c[:, -height:]], 1)[..., : width + 1]
        for c in (autocorrelation(a), autocorrelation(b))
    ]
    return (shifts[0] - shifts[1]).abs().mean((1, 2))
