"""Which places of a feature map see nothing but what counts."""

from __future__ import annotations

import torch
import torch.nn.functional as F

FULL = 0.999  # coverage from which on a feature counts


def fully_covered(coverage: torch.Tensor, size: tuple[int, int]) -> torch.Tensor:
    """(K, h, w) bool, where all pixels at a place of a map of `size` count; (K, H, W) coverage in [0, 1]."""
    return F.adaptive_avg_pool2d(coverage[:, None].float(), size)[:, 0] > FULL
