"""Colours as torchvision's networks read them."""

from __future__ import annotations

import torch

# Of ImageNet's pixels, sRGB in [0, 1].
MEAN = (0.485, 0.456, 0.406)
SPREAD = (0.229, 0.224, 0.225)


def normalise_colours(colours: torch.Tensor) -> torch.Tensor:
    """sRGB (..., 3) in [0, 1] in standard deviations from ImageNet's mean: from about -2.1 to 2.6."""
    return (colours - colours.new_tensor(MEAN)) / colours.new_tensor(SPREAD)
