"""What measures the motion between two pictures in a training."""

from __future__ import annotations

from collections.abc import Callable

import torch

# (first (K, 1, H, W), second (K, 1, H, W)) in [0, 1] -> (K, 2, H, W) [px]
Estimator = Callable[[torch.Tensor, torch.Tensor], torch.Tensor]

FARTHEST = 4.0  # [px], up to which estimators tell a motion


def load_estimator(name: str, device: torch.device | str = "cpu") -> Estimator | None:
    """The flow network, or Lucas and Kanade's method; None for the residual of states."""
    if name == "advection":
        return None
    from mitex.features import flow

    if name == "lucas-kanade":
        return flow.lucas_kanade
    network = flow.flow_network().to(device)
    return lambda first, second: network(torch.cat([first, second], 1))
