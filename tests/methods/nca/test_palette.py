"""Colours that an exemplar has, and growing places of others anew."""

import numpy as np
import pytest
import torch

from mitex.errors import TextureWarning
from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture, healing
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.growth import LookGrowth
from mitex.methods.nca.look import Look
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.perception import perception
from tests.methods.nca.tiny import texture

TEAL = np.array([[0.1, 0.5, 0.5]])


@pytest.fixture(scope="module")
def palette():
    return Palette.of(Exemplar.load("scales").maps["albedo"])


def test_an_exemplar_has_its_own_colours(palette):
    pixels = Exemplar.load("scales").maps["albedo"].reshape(-1, 3)[::37]
    assert palette.unlike(pixels).mean() < 1e-3


def test_other_colours_are_foreign(palette):
    foreign = np.array([[1.0, 0.0, 0.0], [0.1, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    assert palette.unlike(foreign).all()
    assert not palette.unlike(TEAL).any()


def test_one_colour_is_a_palette():
    grey = Palette.of(np.full((16, 16, 3), 0.5, np.float32))
    assert len(grey.colours) == 1
    assert grey.unlike(np.array([[0.5, 0.5, 0.5], [0.9, 0.5, 0.5]])).tolist() == [False, True]


def test_record_round_trip(palette):
    again = Palette.from_record(palette.record())
    np.testing.assert_allclose(again.colours, palette.colours, atol=1e-3)
    assert again.radius == pytest.approx(palette.radius, abs=1e-4)


class Grey(Palette):
    """Everything near grey is known."""

    def __init__(self):
        super().__init__(np.full((1, 3), 0.5), 0.25)


@pytest.fixture
def grown():
    mesh = icosphere(6)
    look = Look(MeshNCA(), ("albedo",), None)
    look.initialise(torch.Generator().manual_seed(3), 0.5)
    return look, Cells(mesh, 0, mesh), perception(mesh, 1)


def _heal(grown, state, palette):
    look, cells, operator = grown
    growth = LookGrowth(look, cells, palette=palette, operator=operator)
    return healing.healed(growth, state, torch.Generator().manual_seed(0))


def test_a_foreign_place_is_set_back_and_grows_again(grown, monkeypatch):
    """With no steps to grow in, what was set back is the seed: the place, three rings, and nothing else."""
    cells = grown[1]
    monkeypatch.setattr(healing, "STEPS", 0)
    state = torch.full((len(cells.mesh.vertices), 16), 0.1)
    graph = cells.mesh.edges
    place = np.zeros(len(state), bool)
    place[[7, *graph.indices[graph.indptr[7] : graph.indptr[8]]]] = True
    state[torch.from_numpy(place), :3] = torch.tensor([0.5, -0.5, -0.5])
    result = _heal(grown, state, Grey())
    for _ in range(healing.RINGS):
        place |= np.bincount(graph.rows, place[graph.indices], len(place)) > 0
    assert (result[torch.from_numpy(place)] == 0).all()
    assert torch.equal(result[torch.from_numpy(~place)], state[torch.from_numpy(~place)])


def test_a_good_state_stays(grown):
    cells = grown[1]
    state = torch.full((len(cells.mesh.vertices), 16), 0.1)
    result = _heal(grown, state, Grey())
    assert torch.equal(result, state)


def test_what_does_not_heal_is_said(grown, monkeypatch):
    cells = grown[1]
    monkeypatch.setattr(healing, "STEPS", 1)
    nowhere = Palette(np.full((1, 3), 9.0), 0.1)
    state = torch.zeros(len(cells.mesh.vertices), 16)
    with pytest.warns(TextureWarning) as warnings:
        result = _heal(grown, state, nowhere)
    assert "100.0% of 'icosphere6' has colours that the exemplar" in str(warnings[0].message)
    assert result.shape == state.shape and result.isfinite().all()


def test_dots_and_lines_are_no_regions(grown):
    mesh = grown[1].mesh
    graph = mesh.edges
    dot, whole = np.zeros((2, len(mesh.vertices)), bool)
    dot[7] = True
    whole[[7, *graph.indices[graph.indptr[7] : graph.indptr[8]]]] = True
    line = np.abs(mesh.vertices[:, 1]) < 0.05
    assert not healing.inner(mesh, dot).any() and line.any() and not healing.inner(mesh, line).any()
    assert np.flatnonzero(healing.inner(mesh, whole)).tolist() == [7]


def test_foreign_colours_are_moved_to_the_nearest_and_others_stay():
    palette = Palette(np.array([[0.2, 0.2, 0.2], [0.8, 0.1, 0.1]]), radius=0.02)
    rng = np.random.default_rng(0)
    colours = rng.random((2000, 3), np.float32)
    held = palette.project(colours)
    foreign = palette.unlike(colours)
    assert 100 < foreign.sum() < 2000 and not palette.unlike(held).any()
    assert np.abs(held - colours)[~foreign].max() < 2e-4
    # On the straight line to the nearest colour of the palette.
    nearest = palette.colours[np.linalg.norm(colours[:, None] - palette.colours, axis=2).argmin(axis=1)]
    assert np.allclose(np.cross(colours - nearest, held - nearest), 0, atol=1e-6)
    assert np.allclose(np.linalg.norm(held - nearest, axis=1)[foreign], 0.1, atol=2e-4)


def test_what_is_applied_has_no_foreign_colours():
    """On a mesh and on a tile; a texture that knows no palette is as it is."""
    plain = texture()
    palette = Palette(np.array([[0.5, 0.5, 0.5]]), radius=0.01)
    bounded = NcaTexture(plain.look, {"palette": palette.record()})
    with pytest.warns(TextureWarning):
        asset = bounded.apply(icosphere(6), resolution=64, subdivide=0, steps=30)
        tile = bounded.tile(32, cells=8, steps=30)["albedo"]
    assert asset.texture_maps is not None
    for albedo in (asset.vertex_maps["albedo"], asset.texture_maps["albedo"], tile):
        assert not palette.unlike(albedo.reshape(-1, 3)).any()
    assert palette.unlike(plain.tile(32, cells=8, steps=30)["albedo"].reshape(-1, 3)).any()
