"""Sources of patches of 32 texels: crops of an image that goes on periodically, and noise."""

import numpy as np
from scipy.ndimage import gaussian_filter

from mitex.quilting.matching import ArraySource

SIDE = 32


def periodic_image(period: int = 64, channels: int = 2, seed: int = 1) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=(period, period, channels))
    smooth = gaussian_filter(noise, (2.0, 2.0, 0.0), mode="wrap")
    return (smooth / smooth.std()).astype(np.float32)


def crops(image: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(P, SIDE, SIDE, C) parts of an image that goes on periodically."""
    index = np.arange(SIDE)
    rows = (corners[:, 0, None] + index) % image.shape[0]
    columns = (corners[:, 1, None] + index) % image.shape[1]
    return image[rows[:, :, None], columns[:, None]]


def every(step: int, period: int = 64) -> np.ndarray:
    """(P, 2) the upper left corners of all crops on a lattice."""
    return np.stack(np.meshgrid(*[np.arange(0, period, step)] * 2, indexing="ij"), -1).reshape(-1, 2)


def crop_source(image: np.ndarray, corners: np.ndarray, channels: int | None = None) -> ArraySource:
    return ArraySource(crops(image, corners), corners.astype(float), float(SIDE), channels)


def noise_source(count: int = 60, channels: int = 3, seed: int = 4) -> ArraySource:
    """Patches that fit nowhere, from all over a plane."""
    draw = np.random.default_rng(seed)
    values = draw.normal(size=(count, SIDE, SIDE, channels)).astype(np.float32)
    return ArraySource(values, draw.random((count, 2)) * 5.0 * SIDE, float(SIDE))


def continued(image: np.ndarray, corner: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    rows, columns = ((first + np.arange(length)) % 64 for first, length in zip(corner, size, strict=True))
    return image[rows[:, None], columns]
