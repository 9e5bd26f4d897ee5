"""The living page in a browser: its states and its pixels against Python's."""

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError, OutputError
from mitex.geometry.vectors import unit
from mitex.mesh import subdivide_midpoint, torus
from mitex.methods.nca import NcaTexture, living_page
from mitex.methods.nca.bake import Grown
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.perception import perception
from mitex.page import quantised
from tests.page.hashes import mask

SEED, TURN = 3, 40.0


@pytest.fixture(scope="module")
def texture():
    return NcaTexture.load("pebbles")


@pytest.fixture(scope="module")
def cells():
    """The page's automaton's mesh."""
    return subdivide_midpoint(quantised(torus(14, 8)), 1)


@pytest.fixture(scope="module")
def tab(browser, texture, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "torus.html"
    living_page(texture, torus(14, 8), path, seed=SEED, steps=1, subdivide=1, orientation=TURN)
    return browser.open(path)


@torch.no_grad()
def states(texture, mesh):
    """The states after each step, (V, C), with the page's masks."""
    look = texture.look
    operator = perception(mesh, look.rule.degree, np.radians(TURN), mean=look.mean)
    state = look.rule.seed(operator)
    for step in range(200):
        fires = torch.from_numpy(mask(len(mesh.vertices), step, SEED))
        state = look.bounded(look.rule.step(state, operator, fires))
        yield state[0]


@pytest.fixture(scope="module")
def grown(tab, texture, cells):
    """The page's state after 200 steps, and Python's; those after 16 are compared on the way."""
    every = list(states(texture, cells))
    tab.run("page.reset(); page.step(16)")
    early = tab.array("page.automaton.read()").reshape(len(cells.vertices), -1)
    assert np.abs(early - every[15].numpy()).max() < 1e-3
    assert every[15].abs().max() > 0.3
    tab.run("page.step(184)")
    return torch.from_numpy(tab.array("page.automaton.read()").reshape(early.shape).copy()), every[-1]


def shown(texture, state, cells, ids):
    """What Python shows at the pixels that see the surface: maps and normals."""
    face, bits = ids[:, 0].astype(np.int64) - 1, ids[:, 1:3].copy().view(np.float32)
    barycentric = np.column_stack([bits, 1 - bits.sum(1)])
    grown = Grown(texture.look, state, Cells(cells, 0, cells), np.radians(TURN), texture._palette)
    maps = grown.maps(grown.values(face.astype(np.int32), barycentric))
    return maps, unit(grown.object_normals(maps["normal"], face, barycentric))


def test_states_are_those_of_python(grown):
    ours, theirs = grown
    # Rounding grows where a pattern can tip over; a cell in a hundred may show it after so many steps.
    assert ((ours - theirs).abs().amax(1) < 0.05).float().mean() > 0.99


def test_pixels_are_those_of_python(tab, texture, cells, grown):
    colour, bent, plain, _, ids = tab.maps()
    hit = ids[..., 0] > 0
    assert 0.2 < hit.mean() < 0.8
    maps, normals = shown(texture, grown[0], cells, ids[hit])
    for values, expected in (
        (colour[hit][:, :3], maps["albedo"]),
        (colour[hit][:, 3:], maps["height"]),
        (bent[hit][:, :3], normals),
        (bent[hit][:, 3:], maps["roughness"]),
        (plain[hit][:, 3:], maps["ambient_occlusion"]),
    ):
        assert np.abs(values - expected).max() < 4e-3  # halves have 11 bits
    assert maps["albedo"].std() > 0.05


def test_the_same_picture_as_of_pythons_state(tab, grown):
    ours = tab.picture()
    tab.run("page.automaton.write(Float32Array.from(argument))", grown[1].ravel().tolist())
    assert np.abs(tab.picture() - ours).mean() < 2e-3
    assert ours.std() > 0.05


def test_erased_cells_are_the_seed_and_grow_again(tab):
    rows, columns = np.nonzero(tab.maps()[-1][..., 0])
    middle = [int(columns[len(rows) // 3]), int(127 - rows[len(rows) // 3])]
    point = tab.run("return page.pick(...argument)", middle)
    erased = tab.run("return page.erase(argument, 0.35)", point)
    count = tab.run("return page.surface.mesh.count")
    state = tab.array("page.automaton.read()").reshape(count, -1)
    assert 5 < len(erased) < count / 4
    assert (state[erased] == 0).all() and (np.delete(state, erased, 0) != 0).any(1).all()
    tab.run("page.step(60)")
    assert (tab.array("page.automaton.read()").reshape(count, -1)[erased] != 0).any(1).all()


def test_nothing_is_fetched_and_nothing_goes_wrong(tab):
    assert (
        tab.errors == [] and len([url for url in tab.requests if not url.startswith(("data:", "blob:"))]) == 1
    )


def test_what_a_page_cannot_follow_is_refused(texture, tmp_path):
    with pytest.raises(ConfigError, match="one angle"):
        living_page(texture, torus(8, 6), tmp_path / "a.html", orientation="up")
    with pytest.raises(ConfigError, match="does not move"):
        living_page(texture, torus(8, 6), tmp_path / "a.html", field="up")
    with pytest.raises(OutputError):
        living_page(texture, torus(8, 6), tmp_path / "a.htm")
    assert list(tmp_path.iterdir()) == []
