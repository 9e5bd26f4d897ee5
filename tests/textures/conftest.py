"""Fixtures for tests of textures."""

import numpy as np
import pytest


@pytest.fixture
def points(rng) -> tuple[np.ndarray, np.ndarray]:
    return tuple(rng.uniform(-0.95, 0.95, (2, 50)).astype(np.float32))
