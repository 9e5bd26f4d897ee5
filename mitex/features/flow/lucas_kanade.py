"""Motion between two frames without a trained network (Lucas & Kanade 1981, pyramids: Bouguet 2001)."""

from __future__ import annotations

import torch
import torch.nn.functional as F

from mitex.errors import ImageError
from mitex.features.flow.warping import check_sides, doubled, halved, normalised_contrast, warp

LEAST_SIDE = 32  # of a frame [px]
WINDOW = 5.0  # standard deviation of the Gaussian in which motion counts as constant [px]
REGULARISER = 1e-2  # Tikhonov's: what is added to both eigenvalues of the structure tensor
LEVELS = 3
ITERATIONS = 3  # at each level


def lucas_kanade(first: torch.Tensor, second: torch.Tensor) -> torch.Tensor:
    """The motion from one frame to the next by coarse-to-fine least squares, up to about 4 pixels.

    At each level of a pyramid, repeatedly: `second` is warped by the motion u so far, and u changes by the
    d that solves (sum w g g^T + eps) d = -sum w g (second(x + u) - first), with the mean gradient g of both
    frames by Scharr's filter and a Gaussian window w. Pixels that u moves out of the frame do not count.
    Brightness and contrast are normalised first. Where gradients have but one direction, only the motion
    along it is found, and none on plain areas: weigh by `smaller_eigenvalue`.

    Args:
        first: (B, 1, H, W) grey values in [0, 1].
        second: (B, 1, H, W), the later frame.

    Returns:
        (B, 2, H, W) float32 [px]: x to the right, y down. Differentiable in both frames.

    Raises:
        ImageError: frames of other or different shapes, or sides under 32 pixels.
    """
    if first.ndim != 4 or first.shape[1] != 1 or first.shape != second.shape:
        shapes = f"frames of shapes {tuple(first.shape)} and {tuple(second.shape)}"
        raise ImageError(shapes, "give two of (B, 1, H, W), grey")
    check_sides(first.shape[2], first.shape[3], LEAST_SIDE)
    pyramid = [(first, second)]
    for _ in range(LEVELS - 1):
        pyramid.append((halved(pyramid[-1][0]), halved(pyramid[-1][1])))
    motion = first.new_zeros(len(first), 2, *pyramid[-1][0].shape[2:])
    for level in reversed(pyramid):
        earlier, later = map(normalised_contrast, level)
        if level is not pyramid[-1]:
            motion = doubled(motion, *earlier.shape[2:])
        for _ in range(ITERATIONS):
            motion = motion + _step(earlier, later, motion)
    return motion


def smaller_eigenvalue(image: torch.Tensor) -> torch.Tensor:
    """How well the surroundings of each pixel fix a motion: the structure tensor's smaller eigenvalue.

    Args:
        image: (B, 1, H, W) grey values in [0, 1].

    Returns:
        (B, H, W), of the image with normalised contrast: near 0 on plain areas, edges and straight stripes.
    """
    a, b, c = _tensor(gradient(normalised_contrast(image))).unbind(1)
    return (a + c) / 2 - ((a - c).square() / 4 + b.square()).sqrt()


def gradient(image: torch.Tensor) -> torch.Tensor:
    """(B, 2, H, W): d/dx and d/dy [1/px] of (B, 1, H, W), by Scharr's 3 x 3 filters."""
    across = image.new_tensor([[-3, 0, 3], [-10, 0, 10], [-3, 0, 3]]) / 32
    filters = torch.stack([across, across.t()])[:, None]
    return F.conv2d(F.pad(image, (1, 1, 1, 1), "replicate"), filters)


def _step(first: torch.Tensor, second: torch.Tensor, motion: torch.Tensor) -> torch.Tensor:
    """The change of a motion (B, 2, H, W) that fits both frames best, linearised."""
    second = warp(second, motion)
    slope = (gradient(first) + gradient(second)) / 2
    inside = _inside(motion)
    a, b, c = _tensor(slope, inside).unbind(1)
    p, q = _window(slope * (second - first) * inside).unbind(1)
    a, c = a + REGULARISER, c + REGULARISER
    return torch.stack([b * q - c * p, b * p - a * q], 1) / (a * c - b.square())[:, None]


def _tensor(slope: torch.Tensor, weight: torch.Tensor | float = 1.0) -> torch.Tensor:
    """(B, 3, H, W): the entries xx, xy, yy of the structure tensor."""
    x, y = slope.unbind(1)
    return _window(torch.stack([x * x, x * y, y * y], 1) * weight)


def _inside(motion: torch.Tensor) -> torch.Tensor:
    """(B, 1, H, W): 1 where a pixel stays in the frame, else 0."""
    height, width = motion.shape[2:]
    x = torch.arange(width, device=motion.device) + motion.detach()[:, 0]
    y = torch.arange(height, device=motion.device)[:, None] + motion.detach()[:, 1]
    return ((x >= 0) & (x <= width - 1) & (y >= 0) & (y <= height - 1)).to(motion.dtype)[:, None]


def _window(image: torch.Tensor) -> torch.Tensor:
    """Each channel (B, C, H, W) in the Gaussian window; nothing counts outside."""
    radius = round(2 * WINDOW)
    weights = torch.exp(-0.5 * (torch.arange(-radius, radius + 1, device=image.device) / WINDOW) ** 2)
    weights = (weights / weights.sum()).to(image.dtype)
    flat = image.flatten(0, 1)[:, None]
    flat = F.conv2d(flat, weights[None, None, None], padding=(0, radius))
    return F.conv2d(flat, weights[None, None, :, None], padding=(radius, 0)).view_as(image)
