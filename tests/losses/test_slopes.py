"""Normals against the slopes of heights, where both are known."""

import pytest
import torch

from mitex.losses import slope_correlation


def _waves(size=48, factor=0.3):
    """Heights (1, n, n) of two waves, and their encoded normals; x right, y up [px]."""
    row, x = torch.meshgrid(*2 * [torch.arange(size, dtype=torch.float64)], indexing="ij")
    y = -row
    height = torch.sin(0.2 * x) + 0.5 * torch.sin(0.15 * y + 0.1 * x)
    along_y = 0.5 * torch.cos(0.15 * y + 0.1 * x)
    slopes = 0.2 * torch.cos(0.2 * x) + 0.1 * along_y, 0.15 * along_y
    normal = torch.stack([-factor * slopes[0], -factor * slopes[1], torch.ones_like(x)], 2)
    normal = normal / normal.norm(dim=2, keepdim=True)
    return height[None].float(), (0.5 + 0.5 * normal)[None].float()


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_normals_of_the_heights_correlate_fully(factor):
    """Whatever the unit of the heights."""
    height, normal = _waves(factor=factor)
    assert slope_correlation(height, normal).item() > 0.995
    assert slope_correlation(0.5 - 7 * height, normal).item() < -0.995


def test_up_is_up():
    """With y downwards only half of the slopes agree."""
    height, normal = _waves()
    downwards = normal * torch.tensor([1.0, -1, 1]) + torch.tensor([0.0, 1, 0])
    assert slope_correlation(height, downwards).item() < 0.9
    mirrored = normal * torch.tensor([-1.0, 1, 1]) + torch.tensor([1.0, 0, 0])
    assert slope_correlation(height, mirrored).item() < 0


def test_unrelated_maps_do_not_correlate():
    generator = torch.Generator().manual_seed(0)
    height = torch.rand(3, 64, 64, generator=generator)
    assert slope_correlation(height, _waves(64)[1].expand(3, -1, -1, -1)).abs().max() < 0.15


def test_a_flat_surface_is_finite():
    flat = torch.full((1, 16, 16), 0.5), torch.full((1, 16, 16, 3), 0.5)
    assert slope_correlation(*flat).item() == 0
    steep = torch.zeros(1, 16, 16, 3, requires_grad=True)
    slope_correlation(_waves(16)[0], steep).sum().backward()
    assert steep.grad is not None and steep.grad.isfinite().all()


def test_gradients_are_those_of_finite_differences():
    height, normal = (part.double() for part in _waves(8))
    height = height + 0.1 * torch.rand(1, 8, 8, generator=torch.Generator().manual_seed(1))
    assert torch.autograd.gradcheck(
        slope_correlation, (height.requires_grad_(), normal.requires_grad_()), fast_mode=True
    )
