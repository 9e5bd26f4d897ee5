"""Distances of patches from what is there, in blocks."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.quilting.block_matching import BlockMatcher, block_means
from mitex.quilting.matching import ArraySource


def test_distances_are_those_of_the_blocks(rng: np.random.Generator):
    values = rng.normal(size=(7, 16, 16, 3)).astype(np.float32)
    matcher = BlockMatcher(ArraySource(values, rng.normal(size=(7, 2)), 1.0, channels=2))
    shares, there = rng.random((4, 4)), rng.normal(size=(4, 4, 2))
    blocks = values[..., :2].reshape(7, 4, 4, 4, 4, 2).mean((2, 4))
    expected = np.sqrt((shares[..., None] * (blocks - there) ** 2).sum((1, 2, 3)))
    np.testing.assert_allclose(matcher.distances(shares, there), expected, rtol=1e-4)
    np.testing.assert_allclose(matcher.distances(np.zeros((4, 4)), there), 0, atol=1e-3)
    np.testing.assert_allclose(block_means(values[0], 8)[1, 0], values[0, 8:, :8].mean((0, 1)), rtol=1e-5)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros((0, 8, 8, 2)), "no patches"),
        (np.full((2, 8, 8, 2), np.nan), "NaN"),
        (np.zeros((2, 6, 6, 2)), "shape"),
    ],
)
def test_unfit_patches_are_refused(values: np.ndarray, message: str):
    with pytest.raises(ConfigError, match=message):
        BlockMatcher(ArraySource(values.astype(np.float32), np.zeros((len(values), 2)), 1.0))
