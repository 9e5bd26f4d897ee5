"""The sRGB curve, on arrays and tensors."""

import numpy as np
import pytest
import torch

from mitex.colour import linear_to_srgb, srgb_to_linear


@pytest.mark.parametrize(
    ("srgb", "linear"), [(0.0, 0.0), (0.04045, 0.0031308), (0.5, 0.21404114), (0.735357, 0.5), (1.0, 1.0)]
)
def test_known_values(srgb, linear):
    assert srgb_to_linear(np.float64(srgb)) == pytest.approx(linear, abs=1e-6)
    assert linear_to_srgb(np.float64(linear)) == pytest.approx(srgb, abs=1e-5)


def test_round_trip_and_agreement_of_numpy_and_torch():
    x = np.linspace(-0.2, 1.5, 400)
    np.testing.assert_allclose(linear_to_srgb(srgb_to_linear(x)), x, atol=1e-12)
    for function in (srgb_to_linear, linear_to_srgb):
        np.testing.assert_allclose(function(torch.from_numpy(x)).numpy(), function(x), atol=1e-12)


def test_float32_stays_float32():
    assert srgb_to_linear(np.ones((2, 3), np.float32)).dtype == np.float32
    assert linear_to_srgb(torch.ones(2)).dtype == torch.float32


@pytest.mark.parametrize("function", [srgb_to_linear, linear_to_srgb])
def test_gradients_are_finite_and_right_everywhere(function):
    """Also below zero, where the unused power branch would be NaN."""
    x = torch.tensor([-0.3, 0.0, 0.001, 0.02, 0.3, 1.2], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(function, (x,))
