"""Keeps cell states in a bounded range."""

from __future__ import annotations

import torch


def overflow_loss(state: torch.Tensor, bound: float = 1.0) -> torch.Tensor:
    """Mean distance of the entries of `state` (any shape) from [-bound, bound] (MeshNCA, equation 15)."""
    return (state - state.clamp(-bound, bound)).abs().mean()
