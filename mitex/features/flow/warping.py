"""Pictures moved along a motion, and what the estimators of motion do to pictures first.

Grey images are (B, 1, H, W), motions (B, 2, H, W): x to the right and y down, in pixels.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F

from mitex.errors import ImageError

NORMALISED_SIDE = 17  # of the square around a pixel that brightness and contrast are measured in [px]
LEAST_CONTRAST = 0.02  # standard deviation below which contrast counts as noise


def warp(image: torch.Tensor, motion: torch.Tensor) -> torch.Tensor:
    """The image as seen from where it came: the value at x is that of the image at x + motion(x).

    The image is interpolated to twice its size by Catmull-Rom splines, and linearly from there on: torch's
    own bicubic interpolation bends a linear ramp, by up to a twentieth of a pixel. The border's value is used
    outside. Differentiable in both.

    Args:
        image: (B, C, H, W).
        motion: (B, 2, H, W) [px].

    Returns:
        (B, C, H, W).
    """
    height, width = image.shape[2:]
    y = torch.arange(height, device=image.device, dtype=image.dtype)[:, None]
    x = torch.arange(width, device=image.device, dtype=image.dtype)
    across, down = 2 * (x + motion[:, 0]) / (width - 1) - 1, 2 * (y + motion[:, 1]) / (height - 1) - 1
    places = torch.stack([across, down], 3)
    return F.grid_sample(_between(image), places, padding_mode="border", align_corners=True)


def _between(image: torch.Tensor) -> torch.Tensor:
    """(B, C, 2 H - 1, 2 W - 1): the pixels, and the Catmull-Rom spline halfway between them."""
    kernel = image.new_tensor([-1, 0, 9, 16, 9, 0, -1]) / 16
    flat = F.pad(image.flatten(0, 1)[:, None], (2, 2, 2, 2), "replicate")
    flat = F.conv_transpose2d(flat, kernel[None, None, None], stride=(1, 2))[..., 7:-7]
    flat = F.conv_transpose2d(flat, kernel[None, None, :, None], stride=(2, 1))[..., 7:-7, :]
    return flat.view(*image.shape[:2], *flat.shape[2:])


def doubled(motion: torch.Tensor, height: int, width: int) -> torch.Tensor:
    """A motion (B, 2, h, w) on the next finer level of (height, width), in its pixels."""
    fine = F.interpolate(motion, scale_factor=2.0, mode="bilinear", align_corners=False)
    return 2 * fine[:, :, :height, :width]


def normalised_contrast(image: torch.Tensor) -> torch.Tensor:
    """(I - mean) / sqrt(variance + LEAST_CONTRAST^2), over the square around each pixel.

    So that brightness, contrast and, nearly, gamma do not matter.

    Args:
        image: (B, C, H, W) grey values in [0, 1]; each channel by itself.

    Returns:
        (B, C, H, W), about -3 to 3.
    """
    mean = _mean(image)
    centred = image - mean
    return centred / (_mean(centred.square()) + LEAST_CONTRAST**2).sqrt()


def _mean(image: torch.Tensor) -> torch.Tensor:
    """Over the square around each pixel, as far as it lies in the image."""
    side = NORMALISED_SIDE
    rows = F.avg_pool2d(image, (1, side), 1, (0, side // 2), count_include_pad=False)
    return F.avg_pool2d(rows, (side, 1), 1, (side // 2, 0), count_include_pad=False)


def halved(image: torch.Tensor) -> torch.Tensor:
    """(B, C, H, W) at half the size, rounded up, each pixel the mean of four."""
    return F.avg_pool2d(image, 2, ceil_mode=True, count_include_pad=False)


def check_sides(height: int, width: int, least: int) -> None:
    """Refuses images in which no motion can be estimated.

    Raises:
        ImageError: a side is shorter than `least` pixels.
    """
    if min(height, width) < least:
        raise ImageError(f"frames of {height} x {width} pixels are too small", f"use {least} or more")
