"""Matrix products of many short rows with small weights, in float32.

On CPUs they run as 1 x 1 convolutions where the number of rows allows: oneDNN uses AVX-512 on every CPU that
has it, the BLAS of torch's wheels on Intel's only (twice as slow elsewhere). Preparing a convolution of a new
shape takes some time, so callers round row counts up to a few that come again.
"""

from __future__ import annotations

from typing import cast

import torch
import torch.nn.functional as F
from torch import nn
from torch.nn.grad import conv2d_weight

# Rows are split into so many images; with fewer than 16, torch does not ask oneDNN.
IMAGES = 64


def layer(inputs: int, outputs: int) -> nn.Linear:
    """A linear layer of zeros: torch's own draws weights, from the generator that all of a program shares."""
    linear = cast(nn.Linear, nn.utils.skip_init(nn.Linear, inputs, outputs))
    linear.load_state_dict({"weight": torch.zeros(outputs, inputs), "bias": torch.zeros(outputs)})
    return linear


def product(x: torch.Tensor, weight: torch.Tensor, bias: torch.Tensor | None = None) -> torch.Tensor:
    """x (N, I) times the transpose of weight (O, I), plus bias (O,): (N, O)."""
    if not _suits(x):
        return F.linear(x, weight, bias)
    return F.conv2d(_images(x), weight[:, :, None, None], bias).permute(0, 2, 3, 1).reshape(len(x), -1)


def weight_gradient(gradient: torch.Tensor, x: torch.Tensor) -> torch.Tensor:
    """Gradient of `product`'s weight: the transpose of gradient (N, O) times x (N, I), (O, I)."""
    if not _suits(x):
        return gradient.t() @ x
    shape = [gradient.shape[1], x.shape[1], 1, 1]
    return conv2d_weight(_images(x), shape, _images(gradient))[:, :, 0, 0]


def padded(count: int) -> int:
    """`count` rows rounded up by at most a sixteenth, to `IMAGES` at least."""
    multiple = max(1 << max(count.bit_length() - 5, 0), IMAGES)
    return -(-max(count, 1) // multiple) * multiple


def _suits(x: torch.Tensor) -> bool:
    return x.device.type == "cpu" and len(x) > 0 and len(x) % IMAGES == 0


def _images(rows: torch.Tensor) -> torch.Tensor:
    """(N, C) as images (IMAGES, C, N / IMAGES, 1), channels last, sharing memory."""
    return rows.view(IMAGES, -1, 1, rows.shape[1]).permute(0, 3, 1, 2)
