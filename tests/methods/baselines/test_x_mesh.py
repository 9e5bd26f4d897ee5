"""X-Mesh: its gates against loops, and what the published start makes of them."""

import math

import pytest
import torch

from mitex.methods.baselines.x_mesh.config import PRESETS
from mitex.methods.baselines.x_mesh.gates import DynamicLayer, Gate
from mitex.methods.baselines.x_mesh.task import places
from mitex.methods.neural_style.field import head, trunk
from tests.methods.neural_style.tiny import tiny

TEXT, WIDTH, HIDDEN, RANK, COUNT = 3, 4, 2, 5, 6


def random(*shape: int, seed: int = 0) -> torch.Tensor:
    return torch.randn(shape, generator=torch.Generator().manual_seed(seed))


def slow_layer(layer: DynamicLayer, weights, row, text) -> list[float]:
    """One row of features through weights that are written out number by number."""
    u, bias, v = (weights[f"{layer.name}.{part}"] for part in ("weight", "bias", "factor"))
    values = []
    for out in range(layer.outputs):
        total = 0.0
        for i in range(layer.inputs + 1):
            entry = 0.0
            for k in range(layer.rank):
                place = i * layer.rank + k
                entry += (float(u[place] @ text) + float(bias[place])) * float(v[k, out])
            total += entry * (float(row[i]) if i < layer.inputs else 1.0)
        values.append(total)
    return values


@pytest.mark.parametrize("axis", [0, 1])
def test_a_gate_by_loops(axis):
    gate = Gate.of("gate", TEXT, WIDTH, HIDDEN, RANK, axis)
    weights = gate.weights(torch.Generator(), 0.0)
    weights = {name: random(*value.shape, seed=k) for k, (name, value) in enumerate(weights.items())}
    features, text = random(COUNT, WIDTH, seed=50), random(TEXT, seed=51)
    rows = []
    for row in features:
        hidden = [max(value, 0.0) for value in slow_layer(gate.layers[0], weights, row, text)]
        rows.append(slow_layer(gate.layers[1], weights, hidden, text))
    expected = torch.empty(COUNT, WIDTH)
    for v in range(COUNT):
        for c in range(WIDTH):
            along = [rows[i][c] for i in range(COUNT)] if axis == 0 else rows[v]
            opening = 1 / (1 + math.exp(-sum(along) / len(along)))
            expected[v, c] = opening * features[v, c]
    assert torch.allclose(gate(weights, features, text), expected, atol=1e-4)


@pytest.mark.parametrize("spread", [0.0, 0.5])
def test_gates_are_half_open_at_first(spread):
    gate = Gate.of("gate", TEXT, WIDTH, HIDDEN, RANK, 0)
    weights = gate.weights(torch.Generator().manual_seed(0), spread)
    features = random(COUNT, WIDTH)
    assert torch.equal(gate(weights, features, random(TEXT)), 0.5 * features)


@pytest.mark.parametrize("spread", [0.0, 0.5])
def test_a_hidden_layer_that_begins_as_zero_never_learns(spread):
    """As published: its derivative is zero in the first step, and after the other layer has moved."""
    gate = Gate.of("gate", TEXT, WIDTH, HIDDEN, RANK, 1)
    weights = gate.weights(torch.Generator().manual_seed(0), spread)
    leaves = {name: value.requires_grad_() for name, value in weights.items()}
    optimizer = torch.optim.SGD(leaves.values(), lr=0.1)
    before = leaves["gate.0.factor"].detach().clone()
    features, text, wanted = random(COUNT, WIDTH), random(TEXT), random(COUNT, WIDTH, seed=1)
    for _ in range(3):
        optimizer.zero_grad()
        (gate(leaves, features, text) - wanted).square().sum().backward()
        optimizer.step()
    assert leaves["gate.1.factor"].detach().abs().sum() > 0
    assert torch.equal(leaves["gate.0.factor"].detach(), before) == (spread == 0)


def test_as_many_weights_as_published():
    """9.61 million, with CLIP's texts of 512 numbers."""
    config, generator = PRESETS["text-paper"], torch.Generator()
    parts = [trunk(256, 256, True), head("a", 256, 3, True), head("b", 256, 3, True)]
    gates = [Gate.of(name, 512, 256, config.gate_width, config.rank, 0) for name in "cd"]
    weights = [part.weights(generator) for part in parts] + [gate.weights(generator, 0) for gate in gates]
    total = sum(value.numel() for part in weights for value in part.values())
    assert total == 9_608_062 and round(total / 1e6, 2) == 9.61


def test_places_are_standardised():
    points = random(500, 3) * torch.tensor([1.0, 2.0, 0.1]) + 5
    scores = places(points, mirror=False)
    assert torch.allclose(scores.mean(0), torch.zeros(3), atol=1e-5)
    assert torch.allclose(scores.std(0), torch.ones(3), atol=1e-5)


def test_mirrored_places_are_folded_first_and_standardised_then():
    """As the authors do: the fold is at z = 0, not at the mean, and the result is standardised."""
    points = random(500, 3) + torch.tensor([5.0, -3.0, 0.7])
    mirrored = places(points, mirror=True)
    folded = points[:, 2].abs()
    assert torch.equal(mirrored[:, :2], places(points, mirror=False)[:, :2])
    assert torch.allclose(mirrored[:, 2], (folded - folded.mean()) / folded.std(), atol=1e-6)
    other_side = torch.cat([points[:, :2], -points[:, 2:]], 1)
    assert torch.equal(places(other_side, mirror=True), mirrored)


def test_both_gates_lie_between_trunk_and_heads():
    """The features that the heads get are a quarter of the trunk's at first, and less if one is closed."""
    task = tiny("x_mesh")
    for name in ("colours.2.weight", "offsets.2.weight"):
        task.named[name].data.fill_(1.0)
    plain = task.style()[0]
    for name in ("channels", "vertices"):
        bias = task.named[f"{name}.1.bias"].data
        factor = task.named[f"{name}.1.factor"].data
        bias.fill_(1.0)
        factor.fill_(-50.0)
        assert not torch.equal(task.style()[0], plain), name
        factor.zero_()
    assert torch.equal(task.style()[0], plain)
