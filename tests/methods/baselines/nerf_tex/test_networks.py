"""The networks of a box."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from mitex.methods.baselines.nerf_tex.networks import FrequencyNetwork, HashNetwork, Inputs, frequencies
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.runtime.jit import mi


def test_the_published_network_has_its_layers():
    """The place has 3 + 3 * 2 * 10 values, view and light 3 + 3 * 2 * 4 each."""
    network = FrequencyNetwork()
    layers = [(63, 256), *[(256, 256)] * 4, (256 + 63, 256), (256, 256), (256, 256)]
    layers += [(256, 1), (256, 256), (256 + 27 + 27, 128), (128, 3)]
    assert sum(math.prod(s) for s in network.shapes.values()) == sum(i * o + o for i, o in layers) == 599_300
    trunk = [network.shapes[f"trunk/{k}/weight"] for k in range(8)]
    assert trunk == [(o, i) for i, o in layers[:8]]


def test_frequencies_are_octaves_of_half_a_period():
    values = torch.tensor([[0.25, 0.0, -1.0]])
    encoded = frequencies(values, 2)[0].tolist()
    sines = [math.sin(math.pi * 2**k * v) for k in range(2) for v in (0.25, 0.0, -1.0)]
    assert encoded[:3] == [0.25, 0.0, -1.0]
    assert encoded[3:6] + encoded[9:12] == pytest.approx(sines, abs=1e-6)


@pytest.mark.parametrize("network", [HashNetwork(8), FrequencyNetwork()], ids=["hash", "frequencies"])
def test_networks_know_place_view_and_light(network):
    """Packed and attached they agree; the density depends on the place alone."""
    parameters = network.initial(torch.Generator().manual_seed(0))
    if "table" in parameters:
        with torch.no_grad():
            parameters["table"].mul_(1e4)
    rng = np.random.default_rng(0)
    values = [rng.uniform(-0.9, 0.9, (50, 3)).astype(np.float32) for _ in range(2)]
    units = rng.normal(size=(4, 50, 3))
    units = (units / np.linalg.norm(units, axis=2, keepdims=True)).astype(np.float32)

    def results(points, view, light):
        directions = (channels(mi.Vector3f, values) for values in (view, light))
        inputs = Inputs(channels(mi.Point3f, points), *directions)
        density, colour = network.attached(parameters, inputs)
        fast, shown = network.evaluator(parameters)(inputs)
        np.testing.assert_allclose(np.array(fast), density.detach().numpy(), rtol=2e-2)
        np.testing.assert_allclose(rows(shown), colour.detach().numpy(), atol=1e-2)
        return density, colour

    density, colour = results(values[0], units[0], units[1])
    assert density.shape == (50,) and colour.shape == (50, 3)
    for changed in ((values[0], units[2], units[1]), (values[0], units[0], units[3])):
        other = results(*changed)
        assert torch.allclose(other[0], density, rtol=1e-4)
        assert (other[1] - colour).abs().max() > 1e-3
    assert (results(values[1], units[0], units[1])[0] - density).abs().max() > 1e-4
    (density.sum() + colour.sum()).backward()
    assert all(value.grad is not None and value.grad.abs().sum() > 0 for value in parameters.values())
