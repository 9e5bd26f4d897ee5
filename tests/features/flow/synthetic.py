"""Textures as functions of the place, so that frames of any motion are exact."""

from collections.abc import Callable

import numpy as np
import torch

Motion = Callable[[torch.Tensor, torch.Tensor], tuple[torch.Tensor, torch.Tensor]]


def texture(x: torch.Tensor, y: torch.Tensor, seed: int = 0) -> torch.Tensor:
    """Forty waves of 5 to 40 pixels in all directions, in about [0, 1]."""
    rng = np.random.default_rng(seed)
    total = torch.zeros_like(x)
    for _ in range(40):
        angle, length, phase = rng.uniform(0, 2 * np.pi), 5 * 8 ** rng.random(), rng.uniform(0, 2 * np.pi)
        total += torch.sin(2 * np.pi / length * (np.cos(angle) * x + np.sin(angle) * y) + phase)
    return 0.5 + total / 30


def pair(motion: torch.Tensor, seed: int = 0) -> torch.Tensor:
    """(1, 2, H, W) frames: what is at x in the first is at x + motion(x) in the second; motion (2, H, W)."""
    x, y = places(*motion.shape[1:])
    return torch.stack([texture(x + motion[0], y + motion[1], seed), texture(x, y, seed)])[None].float()


def places(height: int, width: int) -> tuple[torch.Tensor, torch.Tensor]:
    """x and y of the pixels from the middle of the frame, (H, W) each, float64."""
    y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    return x.double() - (width - 1) / 2, y.double() - (height - 1) / 2


def shift(x: float, y: float, side: int = 64) -> torch.Tensor:
    """The same motion everywhere, (2, side, side)."""
    return torch.tensor([x, y]).double()[:, None, None].expand(2, side, side)


def affine(matrix: list[list[float]], side: int = 64) -> torch.Tensor:
    """matrix (x, y), from the middle of the frame, (2, side, side)."""
    return torch.einsum("ij,jyx->iyx", torch.tensor(matrix).double(), torch.stack(places(side, side)))


def errors(estimate: torch.Tensor, motion: torch.Tensor, margin: int = 16) -> torch.Tensor:
    """End-point errors [px] away from the border of the frame."""
    inside = slice(margin, -margin)
    return (estimate[0].double() - motion).square().sum(0).sqrt()[inside, inside]
