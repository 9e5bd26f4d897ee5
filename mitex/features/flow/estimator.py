"""What measures the motion between two pictures, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import torch

from mitex.features.flow.lucas_kanade import lucas_kanade
from mitex.features.flow.network import flow_network

EstimatorName = Literal["lucas-kanade", "flow"]
# (first (K, 1, H, W), second (K, 1, H, W)) in [0, 1] -> (K, 2, H, W) [px]
Estimator = Callable[[torch.Tensor, torch.Tensor], torch.Tensor]

FARTHEST = 4.0  # [px], up to which estimators tell a motion


def load_estimator(name: EstimatorName, device: torch.device | str = "cpu") -> Estimator:
    """Lucas and Kanade's method, or the flow network.

    Args:
        name: which of the two.
        device: of the network, where its pictures must be; Lucas and Kanade's method works where they are.

    Returns:
        From two pictures (K, 1, H, W), grey in [0, 1], the motion (K, 2, H, W) from the first to the second
        [px], x to the right and y down; differentiable in both.

    Raises:
        WeightsError: those of the network are not there.
    """
    if name == "lucas-kanade":
        return lucas_kanade
    network = flow_network().to(device)
    return lambda first, second: network(torch.cat([first, second], 1))
