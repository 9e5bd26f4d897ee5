"""The sine network against loops, and its initial weights."""

import math

import pytest
import torch

from mitex.methods.nca.decoder.network import SineNetwork


def _network(seed=0, **options):
    network = SineNetwork(5, 3, **options)
    network.initialise(torch.Generator().manual_seed(seed))
    return network


def _slow(network: SineNetwork, x: list[float], omega: float) -> list[float]:
    *hidden, last = network.linear
    for layer in hidden:
        rows = zip(layer.weight.tolist(), layer.bias.tolist(), strict=True)
        x = [math.sin(omega * (sum(w * v for w, v in zip(row, x, strict=True)) + b)) for row, b in rows]
    rows = zip(last.weight.tolist(), last.bias.tolist(), strict=True)
    return [sum(w * v for w, v in zip(row, x, strict=True)) + b for row, b in rows]


@pytest.mark.parametrize("count", [1, 7, 64, 256])  # of multiples of 64, products run another way
@pytest.mark.parametrize("options", [{}, {"width": 9, "depth": 1, "omega": 30.0}, {"depth": 4, "omega": 1.0}])
def test_against_the_loops(count, options):
    network = _network(**options)
    x = torch.rand(count, 5, generator=torch.Generator().manual_seed(1)) * 2 - 1
    expected = torch.tensor([_slow(network, row, options.get("omega", 10.0)) for row in x.tolist()])
    assert torch.allclose(network(x), expected, atol=2e-4)


def test_shapes():
    shapes = [tuple(layer.weight.shape) for layer in _network(width=7, depth=2).linear]
    assert shapes == [(7, 5), (7, 7), (3, 7)]


def test_gradients_against_finite_differences():
    network = _network(width=6, depth=2, omega=3.0).double()
    x = torch.rand(4, 5, dtype=torch.float64, generator=torch.Generator().manual_seed(1), requires_grad=True)
    assert torch.autograd.gradcheck(network, x)
    first = network.linear[0].weight
    (gradient,) = torch.autograd.grad(network(x).sum(), first)
    with torch.no_grad():
        first[2, 3] += 1e-6
        above = network(x).sum()
        first[2, 3] -= 2e-6
        below = network(x).sum()
    assert gradient[2, 3].item() == pytest.approx(((above - below) / 2e-6).item(), rel=1e-4)


def test_initial_weights_fill_their_bounds():
    """1 / inputs in the first layer, sqrt(6 / inputs) / omega in the others, biases 1 / sqrt(inputs)."""
    network = SineNetwork(40, 50, width=60, depth=2, omega=7.0)
    network.initialise(torch.Generator().manual_seed(0))
    bounds = [1 / 40, math.sqrt(6 / 60) / 7, math.sqrt(6 / 60) / 7]
    for layer, bound, inputs in zip(network.linear, bounds, (40, 60, 60), strict=True):
        largest = layer.weight.abs().max().item()
        assert 0.98 * bound < largest <= bound
        assert layer.weight.std().item() == pytest.approx(bound / math.sqrt(3), rel=0.05)
        assert 0.8 * inputs**-0.5 < layer.bias.abs().max().item() <= inputs**-0.5


def test_sines_stay_lively_in_depth():
    """What the bounds are for: deep layers vary as much as the first ones do."""
    network = SineNetwork(20, 30, width=64, depth=6)
    network.initialise(torch.Generator().manual_seed(0))
    x = torch.rand(400, 20, generator=torch.Generator().manual_seed(1)) * 2 - 1
    spread = []
    for layer in network.layers[:-1]:
        x = torch.sin(network.omega * layer(x))
        spread.append(x.std(0).mean().item())
    assert spread[0] > 0.3 and spread[-1] > 0.7 * spread[0]


def test_weights_are_the_generators():
    one, again, other = (_network(seed).state_dict() for seed in (1, 1, 2))
    assert all(torch.equal(one[k], again[k]) for k in one)
    assert all(not torch.equal(one[k], other[k]) for k in one)
