"""Gates that words set: what of a network's features counts, and where (Ma et al. 2023, section 3.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
import torch.nn.functional as F

Weights = Mapping[str, torch.Tensor]


@dataclass(frozen=True)
class DynamicLayer:
    """A linear layer whose weights and biases are those that a text asks for: U(text) V.

    U, one row for each input and one for the bias, is linear in the text; V is the same for all texts.

    Attributes:
        name: under which its weights are.
        text: numbers of the text's embedding.
        inputs, outputs: of the layer.
        rank: columns of U, and rows of V.
    """

    name: str
    text: int
    inputs: int
    outputs: int
    rank: int

    def weights(self, generator: torch.Generator, spread: float = 0.0) -> dict[str, torch.Tensor]:
        """U as PyTorch's layers begin with, V normally distributed; without a spread the layer gives 0."""
        rows, bound = (self.inputs + 1) * self.rank, self.text**-0.5
        weights = {
            name: torch.empty(shape).uniform_(-bound, bound, generator=generator)
            for name, shape in ((f"{self.name}.weight", (rows, self.text)), (f"{self.name}.bias", (rows,)))
        }
        factor = spread * torch.randn(self.rank, self.outputs, generator=generator)
        return weights | {f"{self.name}.factor": factor}

    def __call__(self, weights: Weights, values: torch.Tensor, text: torch.Tensor) -> torch.Tensor:
        """(N, outputs) of values (N, inputs) and a text (D,)."""
        rows = F.linear(text, weights[f"{self.name}.weight"], weights[f"{self.name}.bias"])
        matrix = rows.view(self.inputs + 1, self.rank) @ weights[f"{self.name}.factor"]
        return values @ matrix[:-1] + matrix[-1]


@dataclass(frozen=True)
class Gate:
    """Two dynamic layers, whose mean along one axis says how much of each entry of the other counts.

    Attributes:
        layers: from the features to themselves, by a hidden layer.
        axis: 0, the mean over vertices: the gate of channels; 1, that over channels: the gate of vertices.
    """

    layers: tuple[DynamicLayer, DynamicLayer]
    axis: int

    @staticmethod
    def of(name: str, text: int, width: int, hidden: int, rank: int, axis: int) -> Gate:
        """A gate of features of a width."""
        first = DynamicLayer(f"{name}.0", text, width, hidden, rank)
        return Gate((first, DynamicLayer(f"{name}.1", text, hidden, width, rank)), axis)

    def weights(self, generator: torch.Generator, spread: float) -> dict[str, torch.Tensor]:
        """The gate is half open everywhere at first. The hidden layer's V has a `spread`: if that is 0, as
        published, all hidden numbers are 0, where the derivative of max(0, x) is taken as 0, and V stays 0.
        """
        first, last = self.layers
        return first.weights(generator, spread) | last.weights(generator)

    def __call__(self, weights: Weights, features: torch.Tensor, text: torch.Tensor) -> torch.Tensor:
        """(V, C) features, each times how far its gate is open, from 0 to 1.

        Args:
            features: (V, C).
            text: (D,) embedding.
        """
        first, last = self.layers
        values = last(weights, F.relu(first(weights, features, text)), text)
        return features * values.mean(self.axis, keepdim=True).sigmoid()
