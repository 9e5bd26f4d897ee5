"""Pictures over UVs, looked up at points."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates


def picture_at(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """The colours (M, C) float32 of a picture (H, W, C) at UVs (M, 2), v upwards, bilinear."""
    row, column = (1 - uv[:, 1]) * image.shape[0] - 0.5, uv[:, 0] * image.shape[1] - 0.5
    planes = np.moveaxis(image, 2, 0)
    channels = [map_coordinates(plane, [row, column], order=1, mode="nearest") for plane in planes]
    return np.stack(channels, axis=1).astype(np.float32)
