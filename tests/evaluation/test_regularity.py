"""Regular patterns repeat, others do not."""

import numpy as np

from mitex.evaluation.regularity import regularity
from mitex.exemplar import Exemplar

RNG = np.random.default_rng(0)


def grid(jitter: float) -> np.ndarray:
    """Dots in rows and columns, each moved by up to `jitter` of their distance; (128, 128, 1)."""
    image = np.zeros((128, 128, 1), np.float32)
    y, x = np.mgrid[:128, :128]
    for i in range(0, 128, 16):
        for j in range(0, 128, 16):
            cy, cx = (i + 8, j + 8) + 16 * jitter * RNG.uniform(-1, 1, 2)
            image[..., 0] += np.exp(-((y - cy) ** 2 + (x - cx) ** 2) / 18)
    return image


def test_order_counts():
    values = [regularity(grid(jitter)) for jitter in (0.0, 0.15, 0.5)]
    assert values[0] > 0.95
    assert values[0] > values[1] > values[2]


def test_noise_and_flat_images_have_none():
    assert regularity(RNG.random((128, 128, 3)).astype(np.float32)) < 0.1
    assert regularity(np.full((64, 64, 3), 0.5, np.float32)) == 0.0


def test_wicker_is_more_regular_than_lava():
    wicker, lava = (
        regularity(Exemplar.load(name).resized(256).maps["albedo"]) for name in ("wicker", "lava")
    )
    assert wicker > 2 * lava


def test_what_is_masked_does_not_count():
    """A round piece of a grid is as regular as the grid, whatever lies around it."""
    rows, columns = np.mgrid[:128, :128] - 63.5
    inside = np.hypot(rows, columns) < 56
    noise = RNG.random((128, 128, 1)).astype(np.float32)
    cut = np.where(inside[..., None], grid(0.0), noise)
    assert regularity(cut, inside) > 0.9 > regularity(cut)
