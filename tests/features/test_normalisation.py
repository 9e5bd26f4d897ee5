"""Colours as torchvision's networks read them."""

import pytest
import torch

from mitex.features import normalise_colours


def test_by_hand():
    """Black, white, and ImageNet's mean."""
    colours = torch.tensor([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.485, 0.456, 0.406]])
    expected = [[-2.11790, -2.03571, -1.80444], [2.24891, 2.42857, 2.64], [0, 0, 0]]
    for row, values in zip(normalise_colours(colours).tolist(), expected, strict=True):
        assert row == pytest.approx(values, abs=1e-5)


def test_shape_and_type_stay():
    colours = torch.rand(2, 4, 5, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    values = normalise_colours(colours)
    assert (values.shape, values.dtype) == (colours.shape, colours.dtype)
    assert torch.equal(values[1, 2, 3], normalise_colours(colours[1, 2, 3]))
