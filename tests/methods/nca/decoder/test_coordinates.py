"""Local coordinates: their distributions, what they do not depend on, and the frequencies of the waves."""

import itertools
import math

import numpy as np
import pytest
import torch
from scipy import stats

from mitex.methods.nca.decoder.coordinates import Waves, sorted_barycentrics, symmetric_polynomials

NAMES = {"barycentrics": sorted_barycentrics, "polynomials": symmetric_polynomials}


@pytest.fixture
def points(rng):
    """Barycentrics of points uniform in a triangle."""
    return torch.from_numpy(rng.dirichlet(np.ones(3), 20_000)).float()


def test_sorted_barycentrics_are_uniform(points):
    """Each of the three between -1 and 1, by the test of Kolmogorov and Smirnov; unmapped ones are not."""
    values = sorted_barycentrics(points).numpy()
    assert values.min() >= -1 and values.max() <= 1
    for column in values.T:
        assert stats.kstest(column, "uniform", args=(-1, 2)).statistic < 0.012  # 1 % of samples exceed it
    raw = points.sort(1, descending=True).values.numpy()
    for column in raw.T:
        scaled = (column - column.min()) / np.ptp(column)
        assert stats.kstest(scaled, "uniform").statistic > 0.1


@pytest.mark.parametrize("name", NAMES)
def test_the_order_of_corners_does_not_matter(points, name):
    expected = NAMES[name](points)
    for order in itertools.permutations(range(3)):
        assert torch.allclose(NAMES[name](points[:, order]), expected, atol=1e-6)


def test_values_at_places_with_names():
    """Corners, the middle of a side, the centre."""
    places = torch.tensor([[1.0, 0, 0], [0, 0.5, 0.5], [1 / 3, 1 / 3, 1 / 3]])
    sorted_ = sorted_barycentrics(places)
    assert torch.allclose(sorted_[0], torch.tensor([1.0, -1, -1]), atol=1e-5)
    assert torch.allclose(sorted_[1], torch.tensor([-0.5, 1, -1]), atol=1e-5)
    assert torch.allclose(sorted_[2], torch.tensor([-1.0, 1 / 3, 1]), atol=1e-5)
    polynomials = symmetric_polynomials(places)
    assert torch.allclose(polynomials, torch.tensor([[-1.0, -1], [0.5, -1], [1, 1]]), atol=1e-5)


def test_polynomials_are_smooth_across_medians(points):
    """Sorted barycentrics have kinks there."""
    s = torch.linspace(-1, 1, 201)[:, None]
    line = torch.tensor([0.35, 0.35, 0.3]) + s * torch.tensor([0.2, -0.2, 0.0])
    bends = {name: f(line).diff(n=2, dim=0).abs().amax(0) for name, f in NAMES.items()}
    typical = {name: f(line).diff(n=2, dim=0).abs().median(0).values for name, f in NAMES.items()}
    assert (bends["polynomials"] < 3 * typical["polynomials"] + 1e-5).all()
    assert (bends["barycentrics"] > 10 * typical["barycentrics"]).any()


def test_directions_and_frequencies_of_waves():
    waves = Waves.draw(2000, (0.5, 4.0, 1.0), 0.3)
    assert torch.allclose(waves.vectors.norm(dim=1), torch.tensor([0.5, 4.0, 1.0]).repeat(667)[:2000])
    directions = torch.nn.functional.normalize(waves.vectors, dim=1)
    assert directions.mean(0).abs().max() < 0.05
    assert torch.allclose(directions.T @ directions / 2000, torch.eye(3) / 3, atol=0.03)
    assert stats.kstest(waves.phases.numpy(), "uniform").statistic < 0.04


def test_waves_are_those_of_the_seed():
    one, again, other = (Waves.draw(8, (2.0,), 0.3, seed) for seed in (1, 1, 2))
    assert torch.equal(one.vectors, again.vectors) and torch.equal(one.phases, again.phases)
    assert not torch.equal(one.vectors, other.vectors)


@pytest.mark.parametrize("edge", [0.25, 1.0, 4.0])
@pytest.mark.parametrize("frequency", [0.75, 2.0, 3.0])
def test_the_frequency_is_in_cycles_per_edge(edge, frequency):
    """Counted along each wave's own direction, over 32 edges."""
    waves = Waves.draw(6, (frequency,), 0.5)
    t = torch.arange(1024) / 1024 * 32 * edge
    for k, direction in enumerate(waves.vectors / frequency):
        values = waves(t[:, None] * direction, torch.full((1024,), edge))[:, k]
        spectrum = np.abs(np.fft.rfft(values.numpy()))
        assert spectrum.argmax() == 32 * frequency
        assert spectrum.max() == pytest.approx(0.5 * 512, rel=1e-3)
        assert np.delete(spectrum, 32 * int(frequency) if frequency > 1 else 24).max() < 1


def test_waves_by_hand():
    """Edges of length 1 and 2 have one wave, those between two, the second of half the frequency."""
    waves = Waves(torch.tensor([[0.0, 1.5, 0.0]]), torch.tensor([0.2]), 0.4)
    position, edge = torch.tensor([[9.0, 0.7, -3.0]] * 3), torch.tensor([1.0, 2.0, 2**0.25])
    own, half = (math.cos(2 * math.pi * (1.5 * 0.7 / scale + 0.2)) for scale in (1, 2))
    between = math.sqrt(0.75) * own + math.sqrt(0.25) * half
    assert waves(position, edge)[:, 0].tolist() == pytest.approx(
        [0.4 * own, 0.4 * half, 0.4 * between], abs=1e-5
    )


@pytest.mark.parametrize("octave", [0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 3.3, -2.6])
def test_the_variance_does_not_depend_on_the_edge(rng, octave):
    position = torch.from_numpy(rng.uniform(0, 200, (40_000, 3))).float()
    values = Waves.draw(8, (2.0, 3.0), 0.3)(position, torch.full((40_000,), 2.0**octave))
    assert values.mean(0).abs().max() < 0.01
    assert torch.allclose(values.var(0), torch.tensor(0.3**2 / 2), rtol=0.05)


def test_waves_are_continuous_where_the_edge_changes(rng):
    """Also across powers of two, where another pair of waves is mixed."""
    position = torch.from_numpy(rng.uniform(0, 5, (500, 3))).float()
    waves = Waves.draw(8, (2.0, 3.0), 1.0)
    for middle in (0.5, 1.0, 1.3, 2.0):
        below, above = (
            waves(position, torch.full((500,), middle * factor)) for factor in (1 - 1e-6, 1 + 1e-6)
        )
        assert (below - above).abs().max() < 5e-3
    far, near = (waves(position, torch.full((500,), edge)) for edge in (1.0, 2.0))
    assert (far - near).abs().max() > 1  # octaves apart they differ


def test_waves_know_nothing_of_triangles():
    """They are a function of position and edge alone: nothing else is given to them."""
    waves, position = Waves.draw(4, (2.0,), 0.3), torch.rand(10, 3)
    twice = torch.cat([position, position])
    values = waves(twice, torch.full((20,), 0.7))
    assert torch.equal(values[:10], values[10:])
