"""What a surface shows at its points, read from the states of the cells around them."""

from __future__ import annotations

import torch
from torch import nn

from mitex.methods.nca.decoder.coordinates import Waves, sorted_barycentrics, symmetric_polynomials
from mitex.methods.nca.decoder.network import SineNetwork
from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.decoder.surface import Points, Surface

OFFSET = 0.5  # value = what is read + OFFSET


class Readout(nn.Module):
    """Channels of the state are the values (MeshNCA).

    Args:
        channels: of the state, in the order of the values.
    """

    def __init__(self, channels: list[int]) -> None:
        super().__init__()
        self.channels = channels

    def forward(self, surface: Surface, table: torch.Tensor, points: Points) -> torch.Tensor:
        """Values (P, K), about in [0, 1], at points of a surface; `table` is its table of the state."""
        return surface.read(table[:, self.channels], points) + OFFSET


class Decoder(nn.Module):
    """value(p) = g(s(p), u(p)): the interpolated state, local coordinates, and a small sine network
    (Cells2Pixels, section 3.2). The same rule and decoder give detail at any resolution.

    Args:
        channels: of the state.
        outputs: K, number of values.
        shape: the decoder's parts.
    """

    def __init__(self, channels: int, outputs: int, shape: DecoderShape) -> None:
        super().__init__()
        self.shape, self.outputs = shape, outputs
        self.network = SineNetwork(channels + shape.extra, outputs, shape.width, shape.depth, shape.omega)
        self.waves = Waves.draw(shape.waves, shape.frequencies, shape.amplitude)

    def forward(self, surface: Surface, table: torch.Tensor, points: Points) -> torch.Tensor:
        """Values (P, K), about in [0, 1], at points of a surface; `table` is its table of the state."""
        return self.network(self._inputs(surface, table, points)) + OFFSET

    def mixed(
        self, other: Decoder, surface: Surface, table: torch.Tensor, points: Points, share: torch.Tensor
    ) -> torch.Tensor:
        """Values (P, K) as of a decoder whose weights at each point are those of this one and of another, of
        the same shape, mixed; exactly those of either where its share is all.

        Args:
            share: (P, 1) in [0, 1], of the other.
        """
        own, others = (decoder._inputs(surface, table, points) for decoder in (self, other))
        return self.network.mixed(other.network, torch.lerp(own, others, share), share) + OFFSET

    def _inputs(self, surface: Surface, table: torch.Tensor, points: Points) -> torch.Tensor:
        inputs = [surface.read(table, points)]
        barycentric = points.barycentric.to(table.device)
        for name in self.shape.coordinates:
            if name == "waves":
                inputs.append(self.waves(*surface.place(points)))
            elif name == "barycentrics":
                inputs.append(sorted_barycentrics(barycentric))
            else:
                inputs.append(symmetric_polynomials(barycentric))
        return torch.cat(inputs, 1)
