"""Neural style fields: their networks against torch's layers."""

import math

import torch
from torch import nn

from mitex.methods.neural_style.field import (
    HEAD,
    TRUNK,
    Layers,
    colours,
    encoded,
    head,
    opened,
    random_waves,
    trunk,
)

FEW = torch.Generator().manual_seed(0)


def parameters(*parts: Layers) -> dict[str, torch.Tensor]:
    return {name: value for part in parts for name, value in part.weights(FEW).items()}


def count(*parts: Layers) -> int:
    return sum(value.numel() for value in parameters(*parts).values())


def test_as_many_weights_as_published():
    """659 thousand."""
    assert count(trunk(256, 256), head("colours", 256, 3), head("offsets", 256, 1)) == 659_460
    assert (TRUNK, HEAD) == (5, 2)


def test_places_as_waves():
    waves, points = torch.randn(4, 3, generator=FEW), torch.randn(5, 3, generator=FEW)
    phase = [2 * math.pi * sum(p * w for p, w in zip(points[0], one, strict=True)) for one in waves]
    row = torch.tensor([*points[0], *map(math.cos, phase), *map(math.sin, phase)])
    assert torch.allclose(encoded(points, waves)[0], row, atol=1e-5)
    assert abs(random_waves(4000, 5.0, FEW).std().item() - 5) < 0.1


def test_waves_are_opened_from_the_slowest_on():
    waves = torch.tensor([[3.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 2.0], [0.0, 4.0, 0.0]])
    assert opened(waves, 0.0).tolist() == [0, 0, 0, 0] and opened(waves, 1.0).tolist() == [1, 1, 1, 1]
    assert opened(waves, 0.375).tolist() == [0, 1, 0.5, 0]
    row, plain = encoded(torch.ones(1, 3), waves, opened(waves, 0.375)), encoded(torch.ones(1, 3), waves)
    assert torch.equal(row[0], plain[0] * torch.tensor([1, 1, 1, 0, 1, 0.5, 0, 0, 1, 0.5, 0]))


def test_it_equals_torch_s_layers():
    for normalised in (False, True):
        part = Layers("some", (7, 8, 8, 3), head=True, normalised=normalised)
        weights = {name: value.normal_(generator=FEW) for name, value in part.weights(FEW).items()}
        layers: list[nn.Module] = []
        for k in range(3):
            outputs, inputs = weights[f"some.{k}.weight"].shape
            layer = nn.Linear(inputs, outputs)
            layer.weight.data, layer.bias.data = weights[f"some.{k}.weight"], weights[f"some.{k}.bias"]
            layers.append(layer)
            if k < 2:
                layers.append(nn.ReLU())
            if k < 2 and normalised:
                norm = nn.LayerNorm(outputs)
                norm.weight.data, norm.bias.data = weights[f"some.{k}.gain"], weights[f"some.{k}.shift"]
                layers.append(norm)
        values = torch.randn(5, 7, generator=FEW)
        assert torch.allclose(part(weights, values), nn.Sequential(*layers)(values), atol=1e-5)


def test_a_trunk_ends_as_its_other_layers_do():
    part = trunk(2, 6)
    values = part(parameters(part), torch.randn(9, 7, generator=FEW))
    assert values.min() == 0 and values.max() > 0


def test_the_start_is_grey():
    part = head("colours", 6, 3)
    values = part(parameters(part), torch.randn(9, 6, generator=FEW))
    assert torch.equal(colours(values), torch.full((9, 3), 0.5))
    assert torch.equal(colours(torch.tensor([-50.0, 50.0])), torch.tensor([0.0, 1.0]))
