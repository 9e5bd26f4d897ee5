"""Fixtures of the training's tests."""

import pytest
import torch


@pytest.fixture
def one_thread():
    """Bits are equal on one thread only."""
    torch.set_num_threads(1)
