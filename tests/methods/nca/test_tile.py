"""Maps that repeat: the rule on a flat lattice, and how it is read there."""

import math
import warnings
from typing import Any

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError, TextureWarning
from mitex.geometry.normal_maps import slopes
from mitex.mesh import Lattice
from mitex.methods.nca import MeshNCA, NcaTexture
from mitex.methods.nca import texture as room
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.coordinates import Waves
from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.look import Look
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.perception import harmonics, lattice_perception
from mitex.methods.nca.tile import SampledTile, flat_cells, relief_normals, tile_maps

MAPS = ("albedo", "normal")
SIDE = 64  # of maps [px]


def look(shape: DecoderShape | None = None, mean: bool = True, **options) -> Look:
    model = Look(MeshNCA(**options), MAPS, shape, mean)
    model.initialise(torch.Generator().manual_seed(0), gain=0.5)
    return model


@pytest.fixture(scope="module")
def lattice():
    return Lattice.of(16)


@pytest.fixture(scope="module")
def state(lattice):
    return torch.randn(lattice.count, 16, generator=torch.Generator().manual_seed(1)).clamp(-1, 1) * 0.3


def moved(state: torch.Tensor, lattice: Lattice, rows: int, columns: int) -> torch.Tensor:
    """The state shifted upwards by an even number of rows, and to the right."""
    field = state.view(lattice.rows, lattice.columns, -1)
    return field.roll((rows, columns), (0, 1)).reshape(state.shape)


@pytest.mark.parametrize("mean", [False, True])
def test_cells_perceive_across_the_sides(lattice, state, mean):
    """Against differences of positions, wrapped to the period; +y is up."""
    perceived = lattice_perception(lattice, 2, mean)(state[None])[0].numpy()
    place = lattice.mesh.vertices[: lattice.count].astype(np.float64)
    for i in (0, 5, lattice.columns - 1, lattice.columns, lattice.count - 1):
        offsets = place - place[i]
        offsets -= lattice.columns * np.rint(offsets / lattice.columns)
        length = np.linalg.norm(offsets, axis=1)
        near = np.flatnonzero((length > 0) & (length < 1.3))
        assert len(near) == 6
        weights = harmonics(offsets[near] / length[near, None], 2)
        expected = weights.T @ (state[near] - state[i]).numpy()
        assert np.allclose(perceived[i, :-16].reshape(9, 16), expected, atol=1e-4)
        assert np.array_equal(perceived[i, -16:], state[i].numpy())


@pytest.mark.parametrize("shift", [(0, 1), (2, 0), (6, 5)])
def test_no_place_is_special_to_the_rule(lattice, state, shift):
    model, operator = look(), lattice_perception(lattice)
    with torch.no_grad():
        after = model.rule.step(moved(state, lattice, *shift)[None], operator)[0]
        expected = moved(model.rule.step(state[None], operator)[0], lattice, *shift)
    assert torch.allclose(after, expected, atol=1e-4)
    assert (after - state).abs().max() > 0.01


@pytest.mark.parametrize("shape", [None, DecoderShape(coordinates=("polynomials",), width=12, depth=2)])
def test_no_place_is_special_to_the_maps(lattice, state, shape):
    """Four pixels a column: what is shifted by two columns is shifted by eight pixels."""
    model = look(shape)
    maps, shifted = (tile_maps(model, s, lattice, SIDE) for s in (state, moved(state, lattice, 0, 2)))
    for name in MAPS:
        assert np.allclose(shifted[name], np.roll(maps[name], 8, axis=1), atol=1e-4)
        assert maps[name].std() > 0.01


@pytest.mark.parametrize("shape", [None, DecoderShape(width=12, depth=2)])
def test_pixels_whole_periods_apart_are_equal_to_the_bit(lattice, state, shape):
    sampled, pixels = SampledTile(look(shape), state, lattice), np.arange(SIDE)
    values = sampled.values(pixels, pixels, SIDE)
    for rows, columns in ((SIDE, 0), (-SIDE, 3 * SIDE)):
        again = sampled.values(pixels + rows, pixels + columns, SIDE)
        assert again.tobytes() == values.tobytes()
    across = sampled.values(np.arange(SIDE - 2, SIDE + 2), pixels, SIDE)
    assert across.tobytes() == values[[-2, -1, 0, 1]].tobytes()


def copies(lattice: Lattice) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of faces that are copies of each other, and whose corners have all their neighbours."""
    whole = np.flatnonzero((lattice.mesh.edges.valence[lattice.mesh.faces] == 6).all(1))
    own = lattice.source[lattice.mesh.faces[whole]]
    _, first, inverse = np.unique(own, axis=0, return_index=True, return_inverse=True)
    one, other = whole[first[inverse.ravel()]], whole
    return one[one != other], other[one != other]


@pytest.mark.parametrize("interpolation", ["smooth", "linear"])
def test_what_is_read_goes_on_across_the_sides(lattice, state, interpolation, rng):
    """The mesh shows places near the sides twice, a period apart; waves and states agree there."""
    model = look(DecoderShape(interpolation, width=12, depth=2))
    spread, cells = state[torch.from_numpy(lattice.source)], Cells(lattice.mesh, 0, lattice.mesh)
    one, other = copies(lattice)
    assert len(one) > 4 * lattice.columns
    weights = rng.dirichlet([1, 1, 1], len(one)).astype(np.float32)
    grown = SampledTile(model, state, lattice).grown
    assert np.abs(grown.values(one, weights) - grown.values(other, weights)).max() < 2e-3
    untiled = GrownTexture(model, spread, cells)
    assert np.abs(untiled.values(one, weights) - untiled.values(other, weights)).max() > 0.02


@pytest.mark.parametrize("edge", [0.0376, 0.25, 1.0, 3.0])
def test_waves_repeat_after_the_period(edge, rng):
    waves, period = Waves.draw(16, (2.0, 3.0), 0.3), 40 * edge
    repeating = waves.repeating(period, edge)
    assert (repeating.vectors - waves.vectors).abs().max() <= 0.5 * 2 / 40 + 1e-6
    place = torch.from_numpy(rng.uniform(0, period, (200, 3))).float()
    lengths = torch.full((200,), float(edge))
    for axis in range(3):
        beyond = place + period * torch.eye(3)[axis]
        assert torch.allclose(repeating(place, lengths), repeating(beyond, lengths), atol=2e-3)
        assert (waves(place, lengths) - waves(beyond, lengths)).abs().max() > 0.1


def test_the_picture_is_upright(lattice):
    """A bright cell a quarter of the period from the left and an eighth from the top."""
    state = torch.full((lattice.count, 16), -0.5)
    row = round(7 / 8 * lattice.rows / 2) * 2
    state[row * lattice.columns + lattice.columns // 4, 0] = 0.5
    red = tile_maps(look(), state, lattice, SIDE)["albedo"][..., 0]
    y, x = np.unravel_index(red.argmax(), red.shape)
    assert abs(x - SIDE / 4) <= 1 and abs(y - SIDE * (1 - row / lattice.rows)) <= 1
    assert red.max() > 0.8 and (red > 0.5).mean() < 0.02


def test_normals_are_in_the_picture_s_frame_and_unit(lattice):
    state = torch.zeros(lattice.count, 16)
    state[:, 7:10] = torch.tensor([0.3, -0.2, 0.4])
    normal = tile_maps(look(), state, lattice, SIDE)["normal"]
    direction = np.array([0.6, -0.4, 0.8]) / np.linalg.norm([0.6, -0.4, 0.8])
    assert np.allclose(normal, 0.5 + 0.5 * direction, atol=1e-5)


def test_seeds_and_steps_decide():
    texture = NcaTexture(look(), {"name": "tiny", "density": 8})
    one, again, other, more = (
        texture.tile(32, seed=seed, steps=steps)["albedo"] for seed, steps in ((3, 6), (3, 6), (4, 6), (3, 9))
    )
    assert np.array_equal(one, again) and one.shape == (32, 32, 3)
    assert np.abs(one - other).max() > 1e-3 and np.abs(one - more).max() > 1e-3


def test_foreign_colours_are_told(lattice):
    """A look that is grey, and an exemplar that is red."""
    red = Palette(np.array([[0.9, 0.1, 0.1]]), 0.05).record()
    with pytest.warns(TextureWarning, match="100.0% of 'tile' has colours"):
        NcaTexture(look(), {"palette": red}).tile(32, cells=8, steps=2)
    grey = Palette(np.array([[0.5, 0.5, 0.5]]), 1.0).record()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one = NcaTexture(look(), {"palette": grey}).tile(32, cells=8, steps=2)["albedo"]
    assert np.array_equal(one, NcaTexture(look(), {}).tile(32, cells=8, steps=2)["albedo"])


@pytest.mark.parametrize(
    ("about", "cells"),
    [
        ({"density": 24.0}, 48),
        ({}, 64),
        ({"density": 1}, 8),
        ({"density": "x"}, 64),
        ({"density": math.nan}, 64),
    ],
)
def test_the_exemplar_appears_twice(about, cells, monkeypatch):
    asked = []
    monkeypatch.setattr(room, "flat_cells", lambda *a: asked.append(a) or flat_cells(*a))
    maps = NcaTexture(look(), about).tile(32, steps=0)
    assert asked == [(cells, 32)] and (maps["albedo"] == 0.5).all()


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"resolution": 1}, "1 pixels"),
        ({"resolution": 9000}, "9000 pixels"),
        ({"cells": 7}, "7 cells"),
        ({"cells": 2000}, "2000 cells"),
        ({"steps": -1}, "-1 steps"),
    ],
)
def test_unusable_options(options, problem):
    with pytest.raises(ConfigError, match=problem):
        NcaTexture(look(), {}).tile(**{"resolution": 32} | options)


def test_a_model_with_a_condition_is_refused():
    with pytest.raises(ConfigError, match="needs a condition"):
        NcaTexture(look(condition=2), {"name": "tiny"}).tile(32)


def test_variants_share_mesh_and_layout():
    from mitex.mesh import icosphere

    options: Any = {"subdivide": 0, "steps": 3, "resolution": 64}
    texture, sphere = NcaTexture(look(), {}), icosphere(4)
    one, two = texture.variants(sphere, [5, 6], **options)
    assert (one.name, two.name) == ("seed 5", "seed 6") and one.mesh is two.mesh
    assert one.atlas is not None and two.atlas is not None and np.array_equal(one.atlas.uv, two.atlas.uv)
    assert np.abs(one.vertex_maps["albedo"] - two.vertex_maps["albedo"]).max() > 1e-3
    single = texture.apply(sphere, seed=6, **options)
    assert np.array_equal(single.vertex_maps["albedo"], two.vertex_maps["albedo"])


def test_normals_of_waves_that_repeat(lattice):
    """A wave across and two upwards, whose slopes are known; none breaks at the border."""
    side, bound = 256, 1.5
    x, y = (np.arange(side) + 0.5) / side, 1 - (np.arange(side)[:, None] + 0.5) / side
    height = 0.5 + 0.25 * np.cos(2 * np.pi * x) + 0.25 * np.cos(4 * np.pi * y)
    normal = relief_normals(height[..., None].astype(np.float32), bound, lattice)
    edge = float(lattice.mesh.edge_lengths.mean())
    rate = -2 * np.pi / lattice.columns * bound * edge * 0.5
    rises = np.stack(np.broadcast_arrays(rate * np.sin(2 * np.pi * x), 2 * rate * np.sin(4 * np.pi * y)), -1)
    assert np.abs(slopes(normal) - rises).max() < 0.01 * np.abs(rises).max()


def test_a_texture_from_words_has_normals_in_a_tile():
    maps = {}
    for about in ({"relief": 2.0}, {}):
        model = Look(MeshNCA(), ("albedo", "height"), None, True)
        model.initialise(torch.Generator().manual_seed(0), gain=0.5)
        texture = NcaTexture(model, {"name": "words", "density": 8.0, "growth_steps": 3} | about)
        maps[len(about)] = texture.tile(SIDE, cells=16)
    assert maps[0].keys() == {"albedo", "height"} and maps[1].keys() == {"albedo", "height", "normal"}
    assert np.array_equal(maps[1]["normal"], relief_normals(maps[1]["height"], 2.0, Lattice.of(16)))
