"""The decoder's network: a sine network from a state and local coordinates to the values of the maps."""

from __future__ import annotations

import math

import torch
from torch import nn

from mitex.methods.nca import dense


class SineNetwork(nn.Module):
    """Layers sin(omega (W x + b)), then a linear one (Sitzmann et al. 2020; Cells2Pixels, section 3.2).

    Args:
        inputs: width of x.
        outputs: width of the result.
        width: of the hidden layers.
        depth: number of hidden layers.
        omega: the factor.
    """

    def __init__(
        self, inputs: int, outputs: int, width: int = 32, depth: int = 3, omega: float = 10.0
    ) -> None:
        super().__init__()
        self.omega = omega
        widths = [inputs, *[width] * depth, outputs]
        self.layers = nn.ModuleList(dense.ZeroLinear(a, b) for a, b in zip(widths, widths[1:], strict=False))

    def initialise(self, generator: torch.Generator) -> None:
        """Uniform weights: within 1 / inputs in the first layer, sqrt(6 / inputs) / omega in the others."""
        for k, layer in enumerate(self.linear):
            count = layer.in_features
            bound = 1 / count if k == 0 else math.sqrt(6 / count) / self.omega
            nn.init.uniform_(layer.weight, -bound, bound, generator=generator)
            bound = count**-0.5
            nn.init.uniform_(layer.bias, -bound, bound, generator=generator)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """(P, inputs) -> (P, outputs)."""
        *hidden, last = self.linear
        for layer in hidden:
            x = torch.sin(dense.product(x, self.omega * layer.weight, self.omega * layer.bias))
        return dense.product(x, last.weight, last.bias)

    def mixed(self, other: SineNetwork, x: torch.Tensor, share: torch.Tensor) -> torch.Tensor:
        """As `forward`, with weights and biases that are mixed at each point by the other's `share` (P, 1).

        A layer is linear in its weights, so that the two networks' products are mixed instead.
        """
        *hidden, last = zip(self.linear, other.linear, strict=True)
        for layers in hidden:
            own, others = (dense.product(x, self.omega * n.weight, self.omega * n.bias) for n in layers)
            x = torch.sin(torch.lerp(own, others, share))
        own, others = (dense.product(x, n.weight, n.bias) for n in last)
        return torch.lerp(own, others, share)

    @property
    def linear(self) -> list[nn.Linear]:
        """The layers."""
        return [layer for layer in self.layers if isinstance(layer, nn.Linear)]
