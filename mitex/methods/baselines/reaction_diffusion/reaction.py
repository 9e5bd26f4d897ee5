"""Learned chemicals: dx_i / dt = c_i Laplacian x_i + f_i(x) (Mordvintsev et al. 2021)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
import torch.nn.functional as F

from mitex.sparse import LinearMap

BOUND = 2.0  # of states; those that leave it explode
SHARE = 0.02  # of the cells, from which a state starts
BLUR = 8  # steps of diffusion that make blobs of them
HEIGHT = 4.0  # of the noise before
DECAY = 0.4  # of what is beyond FREE in a step, at the start of a training
FREE = 0.25
PACE = 0.1  # of the reaction in a step: small changes of the weights must not make states explode
SLOPE = 5.0  # of the activation x sigmoid(5 x)


@dataclass(frozen=True, eq=False)
class Reaction:
    """The system of K chemicals.

    Attributes:
        tensors: "inner" (H, K), "bias" (H,) and "outer" (K, H): f(x) = outer s(inner x + bias) / 10.
        rates: (K,) c [cells^2 a step].
    """

    tensors: Mapping[str, torch.Tensor]
    rates: torch.Tensor

    @staticmethod
    def random(channels: int, hidden: int, rates: torch.Tensor, generator: torch.Generator) -> Reaction:
        """Chemicals decay at first where there is much of them, if there are two hidden units for each.

        Two opposite units give s(x - FREE) - s(-x - FREE): next to nothing up to FREE, and x - FREE beyond.
        A start without such a wall lets states explode in the training.
        """
        inner = torch.randn(hidden, channels, generator=generator) / channels**0.5
        bias, outer = torch.zeros(hidden), torch.zeros(channels, hidden)
        pairs = min(channels, hidden // 2)
        one = torch.eye(channels)[:pairs]
        inner[: 2 * pairs] = torch.cat([one, -one])
        bias[: 2 * pairs] = -FREE
        outer[:, : 2 * pairs] = DECAY / PACE * torch.cat([-one.T, one.T], dim=1)
        return Reaction({"inner": inner, "bias": bias, "outer": outer}, rates)

    def speed(self, state: torch.Tensor) -> torch.Tensor:
        """f(x) of states (N, K)."""
        hidden = F.linear(state, SLOPE * self.tensors["inner"], SLOPE * self.tensors["bias"])
        return F.linear(F.silu(hidden), PACE / SLOPE * self.tensors["outer"])

    def evolve(self, state: torch.Tensor, laplacian: LinearMap, steps: int) -> torch.Tensor:
        """States (N, K) after explicit steps of time of length 1."""
        for _ in range(steps):
            state = state + self.rates * laplacian(state) + self.speed(state)
        return state

    def start(self, cells: int, laplacian: LinearMap, generator: torch.Generator) -> torch.Tensor:
        """(N, K) blobs at random places."""
        places = torch.rand(cells, 1, generator=generator) < SHARE
        state = HEIGHT * torch.randn(cells, len(self.rates), generator=generator) * places
        for _ in range(BLUR):
            state = state + float(self.rates.max()) * laplacian(state)
        return state


def geometric_rates(slowest: float, fastest: float, channels: int) -> torch.Tensor:
    """(K,) rates from the slowest to the fastest, each as many times the one before."""
    share = torch.arange(channels) / max(channels - 1, 1)
    return slowest ** (1 - share) * fastest**share


def colours(state: torch.Tensor) -> torch.Tensor:
    """(..., 3) sRGB that states (..., K) show, in [0, 1] where they are within 1/2 of 0."""
    return state[..., :3] + 0.5
