"""A small network for the motion between two frames, trained by `tools/train_flow.py`."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import torch
import torch.nn.functional as F
from torch import nn

from mitex.errors import ImageError
from mitex.features import weights
from mitex.features.flow.warping import check_sides, doubled, halved, normalised_contrast, warp

LEVELS = 4
WIDTH = 48
DEPTH = 5
LEAST_SIDE = 16  # of a frame [px]


class FlowNetwork(nn.Module):
    """Estimates motion from coarse to fine, with the same layers at each level of a pyramid of four.

    A pass warps the second frame by the motion so far and estimates what is left of it, at half the level's
    resolution, from three things: both frames, by a convolution with stride 2; how well they match when one
    is shifted by a pixel (`match_costs`); and the motion and features of the pass before. Residual 3 x 3
    convolutions follow. The finest level has two passes. 117,362 weights; brightness and contrast are
    normalised first.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Conv2d(2, WIDTH, 8, stride=2, padding=3)
        self.match = nn.Conv2d(9, WIDTH, 3, padding=1)
        self.carry = nn.Conv2d(WIDTH + 2, WIDTH, 1)
        self.trunk = nn.ModuleList(nn.Conv2d(WIDTH, WIDTH, 3, padding=1) for _ in range(DEPTH))
        self.head = nn.Conv2d(WIDTH, 2, 3, padding=1)
        for parameter in self.parameters():
            if parameter.ndim == 1:
                nn.init.zeros_(parameter)
            else:
                nn.init.kaiming_normal_(parameter, nonlinearity="relu")
        with torch.no_grad():
            for parameter in self.trunk.parameters():
                parameter *= 0.3  # the trunk begins near the identity
            for parameter in self.head.parameters():
                parameter.zero_()  # no motion at first

    def forward(self, pair: torch.Tensor) -> torch.Tensor:
        """The motion from the first frame to the second.

        Args:
            pair: (B, 2, H, W) grey values in [0, 1].

        Returns:
            (B, 2, H, W) float32 [px]: what is at x in the first frame is at x + motion(x) in the second; x to
            the right, y down. Differentiable in the pair.

        Raises:
            ImageError: another shape, or sides under 16 pixels.
        """
        return self.estimates(pair)[-1]

    def estimates(self, pair: torch.Tensor) -> list[torch.Tensor]:
        """As `forward`, after each pass, from the coarsest level on: a training compares all of them."""
        if pair.ndim != 4 or pair.shape[1] != 2:
            raise ImageError(f"a pair of frames of shape {tuple(pair.shape)}", "give (B, 2, H, W), grey")
        height, width = pair.shape[2:]
        check_sides(height, width, LEAST_SIDE)
        multiple = 2**LEVELS
        pair = F.pad(pair, (0, -width % multiple, 0, -height % multiple), "replicate")
        motions = list(self._passes(pair))
        return [_enlarged(motion, motions[-1].shape[2] * 2)[:, :, :height, :width] for motion in motions]

    def _passes(self, pair: torch.Tensor) -> Iterator[torch.Tensor]:
        """Motions (B, 2, h / 2, w / 2) of levels (h, w), in the level's pixels."""
        pyramid = [pair]
        for _ in range(LEVELS - 1):
            pyramid.append(halved(pyramid[-1]))
        levels = [normalised_contrast(level) for level in reversed(pyramid)]
        motion, features = None, None
        for level in (*levels, levels[-1]):
            motion, features = self._pass(level, motion, features)
            yield motion

    def _pass(
        self, pair: torch.Tensor, motion: torch.Tensor | None, features: torch.Tensor | None
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Motion and features (B, ., h / 2, w / 2) of a level (B, 2, h, w), from those of the pass before."""
        height, width = pair.shape[2] // 2, pair.shape[3] // 2
        if motion is None or features is None:
            motion = pair.new_zeros(len(pair), 2, height, width)
            x = self.stem(pair) + self.match(match_costs(pair))
        else:
            if motion.shape[2] < height:
                motion = doubled(motion, height, width)
                features = F.interpolate(features, scale_factor=2.0, mode="bilinear", align_corners=False)
            second = warp(pair[:, 1:], _enlarged(motion, 2 * height))
            pair = torch.cat([pair[:, :1], second], 1)
            before = self.carry(torch.cat([features, motion], 1))
            x = self.stem(pair) + self.match(match_costs(pair)) + before
        x = F.relu(x)
        for layer in self.trunk:
            x = F.relu(x + layer(x))
        return motion + self.head(x), x


def match_costs(pair: torch.Tensor) -> torch.Tensor:
    """How little the first frame is like the second when that is shifted by -1, 0 or 1 pixel each way.

    Mean squared differences over 6 x 6 pixels, divided by their mean over the nine shifts, less 1.

    Args:
        pair: (B, 2, H, W), even sides.

    Returns:
        (B, 9, H / 2, W / 2).
    """
    height, width = pair.shape[2:]
    second = F.pad(pair[:, 1:], (1, 1, 1, 1), "replicate")
    shifted = [second[:, :, y : y + height, x : x + width] for y in range(3) for x in range(3)]
    costs = F.avg_pool2d((torch.cat(shifted, 1) - pair[:, :1]).square(), 6, 2, 2)
    return costs / (costs.mean(1, keepdim=True) + 0.01) - 1


def flow_network() -> FlowNetwork:
    """The trained network that ships with the package, frozen: gradients reach its input only.

    It stays in float32: bfloat16 would save a quarter of the time, but the gradient of a loss of the motion's
    direction then has a cosine as low as 0.97 with the exact one.

    Raises:
        WeightsError: the file is missing or not the expected one.
    """
    network = FlowNetwork()
    network.load_state_dict(_load())
    for layer in network.modules():
        if isinstance(layer, nn.Conv2d):
            layer.weight.data = layer.weight.data.contiguous(memory_format=torch.channels_last)
    return network.requires_grad_(False)


@cache
def _load() -> dict[str, torch.Tensor]:
    from safetensors.torch import load_file

    path = weights.shipped(weights.FLOW_FILE)
    weights.verify(path, weights.FLOW_SHA256)
    return load_file(path)


def _enlarged(motion: torch.Tensor, height: int) -> torch.Tensor:
    """A motion at half a level's resolution, in the level's pixels, at the height of it or a finer one."""
    scale = height // motion.shape[2]
    return F.interpolate(motion, scale_factor=float(scale), mode="bilinear", align_corners=False) * (
        scale / 2
    )
