"""A moving average of Gram matrices over the views of past steps, through which gradients go straight."""

from __future__ import annotations

from collections.abc import Mapping

import torch


class GramAverage:
    """m <- decay m + (1 - decay) G, divided by 1 - decay^t after t steps, so that the start does not count.

    One view shows a part of a texture only, whose Gram matrix need not be the exemplar's; the average's must.

    Args:
        sizes: layer -> channels C.
        decay: of the average, 0 to below 1.

    Attributes:
        sums: layer -> (C, C) m.
        count: () int64, t.
    """

    def __init__(self, sizes: Mapping[str, int], decay: float) -> None:
        self.decay = decay
        self.sums = {layer: torch.zeros(size, size) for layer, size in sizes.items()}
        self.count = torch.zeros((), dtype=torch.int64)

    def blended(self, grams: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
        """The averages with the Gram matrices of this step; their gradients are those of `grams` alone."""
        weight = 1 - self.decay ** (int(self.count) + 1)
        return {
            layer: gram + (self._next(layer, gram) / weight - gram).detach() for layer, gram in grams.items()
        }

    @torch.no_grad()
    def add(self, grams: Mapping[str, torch.Tensor]) -> None:
        """Keeps the Gram matrices of a step."""
        for layer, gram in grams.items():
            self.sums[layer].copy_(self._next(layer, gram))
        self.count += 1

    def state(self) -> dict[str, torch.Tensor]:
        """What a resumed run needs."""
        return {f"gram/{layer}": total for layer, total in self.sums.items()} | {"gram_count": self.count}

    def load_state(self, state: Mapping[str, torch.Tensor]) -> None:
        """Restores `state`; KeyError or RuntimeError if it does not fit."""
        for name, own in self.state().items():
            own.copy_(state[name])

    def _next(self, layer: str, gram: torch.Tensor) -> torch.Tensor:
        return self.decay * self.sums[layer] + (1 - self.decay) * gram
