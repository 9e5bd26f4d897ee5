"""How regularly a texture repeats."""

from __future__ import annotations

import numpy as np
import torch

from mitex.colour import LUMINANCE
from mitex.losses.autocorrelation import autocorrelation


def regularity(image: np.ndarray) -> float:
    """The highest peak of an image's autocorrelation beside the one at no shift: 1 for perfect repetition.

    Peaks count from the radius on at which the autocorrelation, averaged over all directions, has its first
    minimum: nearer by, anything smooth resembles itself. Shifts go up to half the image's sides.

    Args:
        image: (H, W, 3) or (H, W, 1), several repetitions wide.

    Returns:
        From about 0 (noise) to 1.
    """
    grey = image @ LUMINANCE if image.shape[2] == 3 else image[..., 0]
    maps = torch.from_numpy(np.ascontiguousarray(grey, np.float32))[None, :, :, None]
    height, width = grey.shape[0] // 2, grey.shape[1] // 2
    values = autocorrelation(maps)[0].numpy()
    values = np.concatenate([values[-height:], values[: height + 1]])[:, : width + 1]
    rows, columns = np.mgrid[-height : height + 1, : width + 1]
    radius = np.hypot(rows, columns).astype(int)
    mean = np.bincount(radius.ravel(), values.ravel()) / np.bincount(radius.ravel())
    rising = np.flatnonzero(np.diff(mean[: min(height, width)]) > 0)
    return float(values[radius >= rising[0]].max()) if len(rising) else 0.0
