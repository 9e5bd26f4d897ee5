"""Pairs of frames whose motion is known: crops of grey textures, moved by affine and smooth fields."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import torch
import torch.nn.functional as F
from scipy import ndimage

FASTEST = 4.0  # largest motion [px]
SLOWEST = 0.1  # speeds are drawn evenly over the octaves from here on
ZOOM = 1.4  # texels in a pixel, at most


class Pairs(NamedTuple):
    """Frames (B, 2, H, W), grey in [0, 1], their motion (B, 2, H, W) [px], and where it counts, (B, H, W)."""

    frames: torch.Tensor
    motion: torch.Tensor
    mask: torch.Tensor


class PairMaker:
    """Draws pairs from a set of textures.

    The first frame shows at x what the second shows at x + u(x): both are read by cubic splines from a
    larger, periodic texture, so no border has to be made up.

    Args:
        textures: (N, S, S) float32, grey and periodic, in [0, 1].
        side: of the frames [px].
        changes: whether the look changes between the frames: gamma, brightness, contrast, noise, and up to
            10 % of another texture.
    """

    def __init__(self, textures: np.ndarray, side: int, changes: bool = True) -> None:
        # Three sizes of each, so that shrunk textures do not alias.
        sizes = [textures, *(_shrunk(textures, n) for n in (2, 4))]
        self.scales = [
            np.stack([ndimage.spline_filter(t, mode="grid-wrap") for t in size]).astype(np.float32)
            for size in sizes
        ]
        self.side, self.changes = side, changes

    def draw(self, count: int, generator: torch.Generator) -> Pairs:
        """A batch of pairs."""
        motion = _motions(count, self.side, generator)
        frames = self._read(motion, generator)
        if self.changes:
            other = self._read(torch.zeros_like(motion), generator)[:, :1]
            share = 0.1 * _uniform(count, generator) * _coin(count, 0.5, generator)
            frames = torch.cat([frames[:, :1], torch.lerp(frames[:, 1:], other, share)], 1)
        mask = torch.where(_coin(count, 0.7, generator) > 0, 1.0, _discs(count, self.side, generator))
        frames = torch.lerp(_uniform(count, generator), frames, mask)
        if self.changes:
            frames = _changed(frames, generator)
        return Pairs(frames.clamp(0, 1), motion, mask[:, 0])

    def _read(self, motion: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        """Frames (B, 2, H, W): textures at random places, turned and zoomed, before and after the motion."""
        here = _places(self.side)
        frames = []
        for moved in here + motion:
            textures = self.scales[int(torch.randint(len(self.scales), (), generator=generator))]
            texture = textures[int(torch.randint(len(textures), (), generator=generator))]
            angle = 2 * math.pi * float(torch.rand((), generator=generator))
            zoom = ZOOM * 2 ** -float(torch.rand((), generator=generator))
            turn = zoom * torch.tensor(
                [[math.sin(angle), math.cos(angle)], [math.cos(angle), -math.sin(angle)]]
            )
            if torch.rand((), generator=generator) < 0.5:
                turn = turn.flip(1)
            start = len(texture) * torch.rand(2, 1, 1, 1, generator=generator)
            places = torch.einsum("ij,fjyx->ifyx", turn, torch.stack([moved, here])) + start
            frames.append(ndimage.map_coordinates(texture, places.numpy(), mode="grid-wrap", prefilter=False))
        return torch.from_numpy(np.stack(frames))


def _shrunk(textures: np.ndarray, factor: int) -> np.ndarray:
    count, side = len(textures), textures.shape[1] // factor
    return textures.reshape(count, side, factor, side, factor).mean((2, 4))


def _motions(count: int, side: int, generator: torch.Generator) -> torch.Tensor:
    """(B, 2, H, W) [px]: sums of translations, affine and smooth fields, scaled to a random highest speed."""
    shift = torch.randn(count, 2, 1, 1, generator=generator)
    affine = torch.randn(count, 2, 2, generator=generator) * _coin(count, 0.5, generator)[..., 0]
    linear = torch.einsum("bij,jyx->biyx", affine, _places(side) * (2 / side))
    cells = F.interpolate(torch.randn(count, 2, 6, 6, generator=generator), side + 32, mode="bicubic")
    smooth = cells[..., 16 : 16 + side, 16 : 16 + side] * _coin(count, 0.3, generator)
    motion = shift * _coin(count, 0.8, generator) + linear + smooth
    speed = SLOWEST * (FASTEST / SLOWEST) ** _uniform(count, generator)
    largest = motion.square().sum(1, keepdim=True).amax((2, 3), keepdim=True).sqrt()
    return motion * (speed / largest.clamp_min(1e-6)) * _coin(count, 0.97, generator)


def _changed(frames: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """Gamma, contrast and brightness of each frame by itself, and noise."""
    count = len(frames)
    shape = (count, 2, 1, 1)
    both = torch.randn(count, 1, 1, 1, generator=generator)
    gamma = torch.exp(0.3 * both + 0.15 * torch.randn(shape, generator=generator))
    contrast = 0.25 + 0.75 * _uniform(count, generator) + 0.1 * torch.randn(shape, generator=generator)
    shift = (1 - contrast) * _uniform(count, generator) + 0.05 * torch.randn(shape, generator=generator)
    frames = frames.clamp(1e-4, 1) ** gamma * contrast + shift
    sigma = 0.04 * _uniform(count, generator) ** 2
    return frames + sigma * torch.randn(frames.shape, generator=generator)


def _discs(count: int, side: int, generator: torch.Generator) -> torch.Tensor:
    """(B, 1, H, W): 1 in a disc around a random place; outside is the plain background of an object."""
    centre = side * (torch.rand(count, 2, 1, 1, generator=generator) - 0.5)
    radius = side * (0.3 + 0.5 * _uniform(count, generator))
    distance = (_places(side) - centre).square().sum(1, keepdim=True).sqrt()
    return (radius - distance + 0.5).clamp(0, 1)


def _places(side: int) -> torch.Tensor:
    """(2, H, W): x and y of the pixels, from the frame's centre [px]."""
    axis = torch.arange(side) - (side - 1) / 2
    return torch.stack(torch.meshgrid(axis, axis, indexing="xy"))


def _uniform(count: int, generator: torch.Generator) -> torch.Tensor:
    return torch.rand(count, 1, 1, 1, generator=generator)


def _coin(count: int, chance: float, generator: torch.Generator) -> torch.Tensor:
    """(B, 1, 1, 1): 1 with a chance, else 0."""
    return (_uniform(count, generator) < chance).float()
