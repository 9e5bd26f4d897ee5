"""Which places of a feature map see nothing but what counts."""

from __future__ import annotations

import torch
import torch.nn.functional as F

FULL = 0.999  # coverage from which on a feature counts


def fully_covered(coverage: torch.Tensor, size: tuple[int, int]) -> torch.Tensor:
    """(K, h, w) bool, where all pixels at a place of a map of `size` count; (K, H, W) coverage in [0, 1]."""
    return F.adaptive_avg_pool2d(coverage[:, None].float(), size)[:, 0] > FULL


def covered_places(coverage: torch.Tensor, size: tuple[int, int]) -> torch.Tensor:
    """Indices of a view's features that see nothing but the mesh at their own place; all if there are none.

    Args:
        coverage: (H, W) how much of each pixel shows the mesh.
        size: (h, w) of the layer's map, whose places are counted row by row.
    """
    inside = fully_covered(coverage[None], size)[0]
    return inside.flatten().nonzero()[:, 0] if inside.any() else torch.arange(inside.numel())
