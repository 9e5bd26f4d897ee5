"""How maps resemble themselves at each shift."""

import math

import pytest
import torch

from mitex.losses import autocorrelation_distance
from mitex.losses.autocorrelation import autocorrelation


def waves(size: int, period: float) -> torch.Tensor:
    x = torch.arange(float(size)) * (2 * math.pi / period)
    return torch.sin(x)[None, None, :, None].expand(1, size, size, 1)


def slow(maps: torch.Tensor, dy: int, dx: int) -> float:
    """The definition, for shifts to the right."""
    centred = (maps - maps.mean((1, 2), keepdim=True))[0]
    height, width = centred.shape[:2]

    def mean(dy: int, dx: int) -> float:
        one = centred[max(dy, 0) : height + min(dy, 0), dx:]
        other = centred[max(-dy, 0) : height + min(-dy, 0), : width - dx]
        return float((one * other).sum(2).mean())

    return mean(dy, dx) / mean(0, 0)


def test_it_is_the_mean_product_over_what_both_copies_cover():
    maps = torch.rand(1, 9, 12, 3, generator=torch.Generator().manual_seed(0))
    values = autocorrelation(maps)[0]
    for dy in range(-8, 9):
        for dx in range(12):
            assert values[dy, dx].item() == pytest.approx(slow(maps, dy, dx), abs=1e-5)


def test_a_wave_comes_back_after_its_period():
    values = autocorrelation(waves(64, 8.0))[0, 0]
    assert values[[0, 8, 16]].tolist() == pytest.approx([1, 1, 1], abs=1e-4)
    assert values[[4, 12]].tolist() == pytest.approx([-1, -1], abs=1e-4)


def test_the_distance_knows_the_period_and_neither_place_nor_contrast_nor_size():
    here = waves(64, 8.0)
    there = 3 * torch.roll(here, 3, 2)[:, :48, :48] + 0.2
    assert autocorrelation_distance(here, there).item() < 0.02
    assert autocorrelation_distance(here, waves(64, 12.0)).item() > 0.3


def test_gradients():
    a = torch.rand(2, 6, 7, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    b = torch.rand(2, 8, 6, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
    assert torch.autograd.gradcheck(lambda x: autocorrelation_distance(x, b), a.requires_grad_())


def test_places_outside_the_mask_do_not_count():
    maps = torch.rand(1, 9, 12, 2, generator=torch.Generator().manual_seed(3))
    mask = torch.zeros(9, 12)
    mask[2:7, 3:11] = 1
    values, piece = autocorrelation(maps, mask)[0], autocorrelation(maps[:, 2:7, 3:11])[0]
    for dy in range(-4, 5):
        assert values[dy, :8].tolist() == pytest.approx(piece[dy, :8].tolist(), abs=1e-5)
