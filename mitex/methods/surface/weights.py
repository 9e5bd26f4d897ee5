"""The weights of the network that textures are looked at with."""

from __future__ import annotations

import torch

from mitex.features.layers import LAYERS
from mitex.features.vgg import Weights, convolutions
from mitex.features.vgg19 import vgg19_convolutions
from mitex.methods.surface.config import SurfaceConfig


def network_weights(config: SurfaceConfig, generator: torch.Generator) -> Weights | None:
    """Layer -> weight and bias, drawn by the generator or of the user's file; None for the package's."""
    if config.weights == "random":
        return random_weights(generator)
    return vgg19_convolutions() if config.weights == "vgg19" else None


def random_weights(generator: torch.Generator) -> Weights:
    """Weights of the network's shape, drawn as He et al. do, without biases (figure 5 b)."""
    weights, trained = {}, convolutions("average", False)
    for name in LAYERS:
        weight, bias = trained[name]
        scale = (2.0 / weight[0].numel()) ** 0.5
        weights[name] = torch.randn(weight.shape, generator=generator) * scale, torch.zeros_like(bias)
    return weights
