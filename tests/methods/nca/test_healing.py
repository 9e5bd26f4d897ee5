"""Places of foreign colours go back to the seed and grow again; what is left is said."""

import warnings

import numpy as np
import pytest
import torch

from mitex.errors import TextureWarning
from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture, healing
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.growth import LookGrowth
from mitex.methods.nca.healing import healed
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.perception import perception
from tests.methods.nca import tiny

GREY = Palette(np.full((1, 3), 0.5), 0.1)


@pytest.fixture
def look():
    """Without a decoder, and of a rule that leaves every state as it is."""
    look = tiny.texture(shape=None).look
    for parameter in look.rule.parameters():
        torch.nn.init.zeros_(parameter)
    return look


@pytest.fixture(scope="module")
def cells():
    return Cells.of(icosphere(8), 0)


def _heal(look, state, cells, palette=GREY):
    generator = torch.Generator().manual_seed(0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return healed(LookGrowth(look, cells, palette=palette), state, generator)


def _blob(cells, count=20):
    """A state of the exemplar's colours, but near one vertex, and which cells are there."""
    distance = np.linalg.norm(cells.mesh.vertices - cells.mesh.vertices[100], axis=1)
    places = torch.from_numpy(distance <= np.sort(distance)[count - 1])
    state = torch.full((len(distance), 16), 0.05)
    state[places, :3] = 0.5
    return state, places


def test_a_state_of_the_exemplars_colours_stays(look, cells):
    state = torch.full((642, 16), 0.05)
    assert _heal(look, state, cells) is state


def test_a_dot_is_a_pattern_of_its_own(look):
    """One cell in a thousand may have any colour."""
    cells = Cells.of(icosphere(11), 0)
    state = torch.zeros(1212, 16)
    state[7, :3] = 0.5
    assert _heal(look, state, cells) is state


def test_a_blob_is_set_back_with_its_neighbours(look, cells):
    """Three rings of them, counted from face to face; everything else stays as it was."""
    state, places = _blob(cells)
    result = _heal(look, state, cells)
    around = set(places.nonzero().view(-1).tolist())
    for _ in range(3):
        around |= {v for face in cells.mesh.faces.tolist() if around & set(face) for v in face}
    inside = torch.zeros(642, dtype=torch.bool)
    inside[list(around)] = True
    assert 40 < inside.sum() < 200
    assert not result[inside].any() and torch.equal(result[~inside], state[~inside])


def test_it_grows_again_with_the_rule(cells):
    """As the automaton would from there, for sixty steps, within the bounds of the training."""
    look = tiny.texture(shape=None).look
    with torch.no_grad():
        look.rule.fc2.weight.mul_(0.02)
    state, _ = _blob(cells)
    result = _heal(look, state, cells)
    foreign = GREY.unlike(np.clip(state[:, :3].numpy() + 0.5, 0, 1))
    expected = torch.where(torch.from_numpy(healing._around(cells, foreign))[:, None], 0.0, state)
    generator, operator = torch.Generator().manual_seed(0), perception(cells.mesh, mean=True)
    with torch.no_grad():
        for _ in range(60):
            expected = look.clamp(look.rule.evolve(expected[None], operator, 1, generator))[0]
    assert torch.equal(result, expected) and not result.requires_grad
    assert result.abs().max() > 0.01


def test_what_cannot_be_healed_is_said(look, cells):
    """A rule that drives every cell to white."""
    with torch.no_grad():
        look.rule.fc2.bias[:3] = 0.1
    state, _ = _blob(cells)
    with pytest.warns(TextureWarning) as warnings:
        result = healed(LookGrowth(look, cells, palette=GREY), state, torch.Generator().manual_seed(0))
    assert "100.0% of 'icosphere8' has colours" in str(warnings[0].message)
    assert result.shape == state.shape and GREY.unlike(result[:, :3].numpy() + 0.5).all()


def test_textures_with_a_palette_are_healed(monkeypatch):
    """On the automaton's mesh, whichever mesh is textured; others are left alone."""
    calls = []

    def spy(growth, state, generator):
        calls.append((len(state), len(growth.cells.base.vertices)))
        return torch.zeros_like(state)

    sphere, plain = icosphere(3), tiny.texture(shape=None)
    options = {"steps": 8, "subdivide": 1, "resolution": None}
    assert plain.apply(sphere, **options).vertex_maps["albedo"].std() > 0
    monkeypatch.setattr("mitex.methods.nca.texture.healed", spy)
    about = {"name": "tiny", "palette": GREY.record()}
    asset = NcaTexture(plain.look, about).apply(sphere, **options)
    assert calls == [(362, 92)] and (asset.vertex_maps["albedo"] == 0.5).all()
