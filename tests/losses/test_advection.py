"""The transport residual of values whose transport is known."""

import math

import pytest
import torch

from mitex.losses import advection_residual

POINTS, DISTANCE = torch.arange(64, dtype=torch.float64) / 64, 1.5 / 64


def _waves(shift=0.0, scale=1.0):
    """(64, 3) values on a circle of length 1, moved by a shift."""
    angles = 2 * math.pi * (POINTS - shift)
    return scale * torch.stack([angles.sin(), (2 * angles).cos(), 0.3 + 0.1 * (3 * angles).sin()], 1)


def test_it_is_the_sum_over_vertices_and_channels():
    generator = torch.Generator().manual_seed(0)
    before, after, upstream = torch.randn(3, 5, 2, generator=generator, dtype=torch.float64)
    left = way = 0.0
    for i in range(5):
        for j in range(2):
            left += (after[i, j].item() - upstream[i, j].item()) ** 2
            way += (upstream[i, j].item() - before[i, j].item()) ** 2
    assert advection_residual(before, after, upstream).item() == pytest.approx(left / way)


def test_a_perfect_transport_costs_nothing_and_none_costs_one():
    before, upstream = _waves(), _waves(DISTANCE)
    assert advection_residual(before, upstream, upstream).item() == 0
    assert advection_residual(before, before, upstream).item() == pytest.approx(1)
    assert advection_residual(before, _waves(-DISTANCE), upstream).item() == pytest.approx(4, rel=0.02)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_scale_of_the_values_does_not_matter(scale):
    one, other = (
        advection_residual(_waves(0, s), _waves(DISTANCE / 2, s), _waves(DISTANCE, s)) for s in (1.0, scale)
    )
    assert one.item() == pytest.approx(other.item()) and one.item() == pytest.approx(0.25, rel=0.02)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_fading_to_grey_is_worse_than_standing_still(share):
    before, upstream = _waves(), _waves(DISTANCE)
    assert advection_residual(before, share * before, upstream) > 1


def test_to_the_first_order_it_is_the_equation_of_transport():
    """|S(t + n) - S(t) + d dS/dx|^2 / |d dS/dx|^2 differs by the square of the distance, or less."""
    differences = []
    for distance in (4e-3, 2e-3):
        before, after, upstream = _waves(), _waves(0.4 * distance), _waves(distance)
        step = 1e-6
        change = distance * (_waves(-step) - _waves(step)) / (2 * step)
        linear = (after - before + change).square().sum() / change.square().sum()
        differences.append((advection_residual(before, after, upstream) - linear).abs().item())
    assert differences[0] > 3.5 * differences[1] and differences[1] < 1e-3


def test_only_what_happens_afterwards_has_a_gradient():
    before, after, upstream = (_waves(shift).requires_grad_() for shift in (0, 0.01, DISTANCE))
    assert torch.autograd.gradcheck(lambda a: advection_residual(before, a, upstream), after)
    advection_residual(before, after, upstream).backward()
    assert before.grad is None and upstream.grad is None


def test_a_floor_counts_as_a_longer_way():
    """So that a state without a way has a residual by how still it stands."""
    before, after = _waves(), _waves(0.001)
    variance = (before - before.mean(0)).square().sum().item()
    left, way = ((_waves(0.002) - other).square().sum().item() for other in (after, before))
    residual = advection_residual(before, after, _waves(0.002), floor=0.3).item()
    assert residual == pytest.approx(left / (way + 0.3 * variance))
    moved = (after - before).square().sum().item()
    assert advection_residual(before, after, before, floor=0.3).item() == pytest.approx(
        moved / (0.3 * variance)
    )


def test_a_state_without_a_pattern_has_a_finite_residual():
    grey = torch.full((9, 2), 0.5)
    assert advection_residual(grey, grey, grey) == 0
