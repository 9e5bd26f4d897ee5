"""The living page in Firefox: the same states, pixels and files as in Chromium."""

import numpy as np
import pytest
import torch

from mitex.mesh import Mesh, subdivide_midpoint, torus
from mitex.methods.nca import NcaTexture, living_page
from mitex.page import quantised
from tests.methods.nca.pages import after, shown, states

SEED, TURN = 3, 40.0
CELLS = subdivide_midpoint(quantised(torus(12, 6)), 1)


@pytest.fixture(scope="module")
def texture():
    return NcaTexture.load("pebbles")


@pytest.fixture(scope="module")
def tab(firefox, texture, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "torus.html"
    options = {
        "seed": SEED,
        "orientation": TURN,
        "steps": 1,
        "subdivide": 1,
    }
    return firefox.open(living_page(texture, torus(12, 6), path, **options))


def state(tab):
    return torch.from_numpy(tab.array("page.automaton.read()").copy()).reshape(len(CELLS.vertices), -1)


def test_states_and_pixels_are_those_of_python(tab, texture):
    turn = np.radians(TURN)
    expected = after(16, states(texture, CELLS, SEED, turn))
    tab.run("page.reset(); await page.step(16)")
    assert (state(tab) - expected).abs().max() < 1e-3 < 0.3 < expected.abs().max()
    colour, bent, plain, _, ids = tab.maps()
    hit = ids[..., 0] > 0
    assert 0.2 < hit.mean() < 0.8
    maps, normals = shown(texture, state(tab), CELLS, turn, ids[hit])
    for values, known in (
        (colour[hit][:, :3], maps["albedo"]),
        (bent[hit][:, :3], normals),
        (bent[hit][:, 3:], maps["roughness"]),
        (plain[hit][:, 3:], maps["ambient_occlusion"]),
    ):
        assert np.abs(values - known).max() < 4e-3
    assert tab.picture().std() > 0.05


def test_hands_do_what_they_do_in_chromium(tab):
    tab.run("await page.step(40)")
    before = tab.picture()
    rows, columns = np.nonzero(tab.maps()[-1][..., 0])
    middle = [int(columns[len(rows) // 3]), int(127 - rows[len(rows) // 3])]
    erased = tab.run("page.panel.choose('erase'); return page.erase(page.pick(...argument))", middle)
    assert (state(tab)[erased] == 0).all() and np.abs(tab.picture() - before).max() > 0.1
    tab.run("await page.step(40)")
    assert (state(tab)[erased] != 0).any(1).all()
    tab.run("page.panel.graft(1); page.setShare(1); page.panel.show('graft')")
    assert np.abs(tab.picture() - before).max() > 0.1
    tab.run("page.panel.graft('none'); page.panel.show('light')")


def test_files_are_written_and_read(tab, tmp_path):
    path = tmp_path / "torus.glb"
    path.write_bytes(tab.array("await page.glb(128)").tobytes())
    assert len(Mesh.load(path).faces) == len(CELLS.faces)
    lines = [f"v {x} {y} {z}" for x, y, z in torus(8, 5).vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in torus(8, 5).faces]
    count = tab.run(
        """page.panel.open(new File([argument], "ring.obj"));
        while (page.base.name !== "ring") await new Promise((done) => setTimeout(done, 20));
        return page.base.count""",
        "\n".join(lines),
    )
    assert count == 40
