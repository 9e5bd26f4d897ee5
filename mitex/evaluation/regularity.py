"""How regularly a texture repeats."""

from __future__ import annotations

import numpy as np
import torch

from mitex.colour import LUMINANCE
from mitex.losses.autocorrelation import autocorrelation

LEAST_OVERLAP = 0.1  # of the pixels that count, at a shift that counts


def regularity(image: np.ndarray, mask: np.ndarray | None = None) -> float:
    """The highest peak of an image's autocorrelation beside the one at no shift: 1 for perfect repetition.

    Peaks count from the radius on at which the autocorrelation, averaged over all directions, has its first
    minimum: nearer by, anything smooth resembles itself. Shifts go up to half the image's sides.

    Args:
        image: (H, W, 3) or (H, W, 1), several repetitions wide.
        mask: (H, W) bool, pixels that count; shifts at which few of them overlap do not count.

    Returns:
        From about 0 (noise) to 1.
    """
    grey = image @ LUMINANCE if image.shape[2] == 3 else image[..., 0]
    counting = np.ones(grey.shape, bool) if mask is None else mask
    maps = torch.from_numpy(np.ascontiguousarray(grey, np.float32))[None, :, :, None]
    covered = torch.from_numpy(counting.astype(np.float32))
    height, width = grey.shape[0] // 2, grey.shape[1] // 2

    def near(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values[-height:], values[: height + 1]])[:, : width + 1]

    values = near(autocorrelation(maps, covered)[0].numpy())
    enough = near(_overlap(covered)) >= LEAST_OVERLAP * counting.sum()
    rows, columns = np.mgrid[-height : height + 1, : width + 1]
    radius = np.hypot(rows, columns).astype(int)
    mean = np.bincount(radius[enough], values[enough]) / np.maximum(np.bincount(radius[enough]), 1)
    rising = np.flatnonzero(np.diff(mean[: min(height, width)]) > 0)
    beyond = enough & (radius >= rising[0]) if len(rising) else np.zeros_like(enough)
    return float(values[beyond].max()) if beyond.any() else 0.0


def _overlap(mask: torch.Tensor) -> np.ndarray:
    """(2 H, W + 1): how many places of a mask (H, W) lie on places of its shifted copy."""
    size = (2 * mask.shape[0], 2 * mask.shape[1])
    return torch.fft.irfft2(torch.fft.rfft2(mask, s=size).abs().square(), s=size)[
        :, : mask.shape[1] + 1
    ].numpy()
