"""Normals in views against the exemplar's."""

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.methods.nca.relief import Relief
from mitex.triples import map_layout

LAYOUT = map_layout(["albedo", "height", "normal"])


@pytest.fixture(scope="module")
def exemplar():
    maps = Exemplar.load("scales").resized(128).maps
    return Exemplar({name: maps[name] for name in LAYOUT}, "scales")


def _values(exemplar, size):
    maps = exemplar.resized(size).maps
    return torch.from_numpy(np.concatenate([maps[name] for name in LAYOUT], axis=2))[None]


def test_the_exemplar_itself_costs_nothing(exemplar):
    relief = Relief(exemplar, LAYOUT, [64, 128])
    for size in (64, 128):
        assert relief(_values(exemplar, size), size).item() == 0


def test_normals_of_another_place_cost(exemplar):
    """As much as the exemplar's own correlation, about, as they have none."""
    values = _values(exemplar, 128)
    moved = values.clone()
    moved[..., 4:] = values[..., 4:].flip(1).roll(17, 2)
    relief = Relief(exemplar, LAYOUT, [128])
    assert 0.5 < relief(moved, 128).item() < 1.4
    assert relief(torch.cat([values, moved]), 128).item() == pytest.approx(relief(moved, 128).item() / 2)


def test_descent_turns_normals_to_the_heights(exemplar):
    values = _values(exemplar, 64)
    normal = torch.full_like(values[..., 4:], 0.5)
    normal[..., 2] = 1.0
    normal += 0.02 * torch.randn(normal.shape, generator=torch.Generator().manual_seed(0))
    normal.requires_grad_()
    relief = Relief(exemplar, LAYOUT, [64])
    adam = torch.optim.Adam([normal], lr=0.02)
    for _ in range(40):
        loss = relief(torch.cat([values[..., :4], normal], 3), 64)
        adam.zero_grad()
        loss.backward()
        adam.step()
    assert loss.item() < 0.1
