"""Textures that flow in the living page: states that are carried along a field, against Python's."""

import numpy as np
import pytest

from mitex.mesh import subdivide_midpoint, torus
from mitex.methods.nca import NcaTexture, living_page
from mitex.methods.nca.motion.cell_motion import look_motion
from mitex.methods.nca.page import contents
from mitex.page import quantised
from tests.methods.nca import tiny
from tests.methods.nca.pages import after, states

GIVEN = torus(12, 6)
STEPS, SPEED, TURN = 16, 1.4, 40.0
TEXTURES = {
    "still": NcaTexture(tiny.texture(("albedo", "normal"), shape=None).look, {"name": "still"}),
    "trained": NcaTexture(
        tiny.texture(("albedo", "normal"), condition=3, shape=None).look,
        {"name": "trained", "motion": "up", "motion_advection": True, "motion_period": 4, "motion_speed": 4},
    ),
}


def grown(texture, field, speed=SPEED):
    """The states (V, C) after `STEPS` steps."""
    base = quantised(GIVEN)
    mesh = subdivide_midpoint(base, 1)
    motion = look_motion(texture.look, texture.about, base, mesh, field, speed, np.radians(TURN))
    every = states(texture, mesh, turn=np.radians(TURN), motion=motion)
    return after(STEPS, every).numpy().ravel()


def page_states(tab):
    tab.run(f"page.reset(); await page.step({STEPS})")
    return tab.array("page.automaton.read()")


@pytest.fixture(params=TEXTURES)
def texture(request):
    return TEXTURES[request.param]


@pytest.mark.parametrize("way", ["webgl", "webgpu"])
def test_states_are_carried_as_in_python(browser, texture, way, tmp_path):
    options = {"steps": 1, "subdivide": 1, "orientation": TURN, "field": "about-x", "speed": SPEED}
    tab = browser.open(living_page(texture, GIVEN, tmp_path / "a.html", **options), steps=way)
    expected = grown(texture, "about-x")
    assert np.abs(page_states(tab) - expected).max() < 1e-3 < 0.1 < np.abs(expected).max()
    assert np.abs(expected - grown(texture, "up")).max() > 0.05
    # A field at another speed, and a texture that was turned and turned back.
    tab.run("page.move('up', 1); page.orient(1); page.orient(argument)", np.radians(TURN))
    assert np.abs(page_states(tab) - grown(texture, "up", 1.0)).max() < 1e-3
    assert tab.errors == []


def test_a_still_texture_flows_from_the_panel(browser, tmp_path):
    """One of those that ship; it stands still until a direction is taken, and again without one."""
    texture = NcaTexture.load("ceramic")
    options = {"steps": 1, "subdivide": 1, "orientation": TURN}
    tab = browser.open(living_page(texture, GIVEN, tmp_path / "a.html", **options), steps="webgl")

    def pressed():
        return tab.page.locator("[aria-label=Direction] [aria-pressed=true]").all_text_contents()

    still = grown(texture, None, 1.0)
    assert pressed() == ["none"] and np.abs(page_states(tab) - still).max() < 1e-3
    tab.page.get_by_role("button", name="about y").click()
    assert pressed() == ["about y"]
    flowing = grown(texture, "about-y", 1.0)
    assert np.abs(page_states(tab) - flowing).max() < 1e-3 < 0.1 < np.abs(flowing - still).max()
    tab.page.get_by_role("button", name="none").click()
    assert np.abs(page_states(tab) - still).max() < 1e-3
    assert tab.errors == []


def test_vertices_without_a_face_do_no_harm(browser, tmp_path):
    """Those of files that are dropped onto the page."""
    tab = browser.open(living_page(TEXTURES["still"], GIVEN, tmp_path / "a.html", steps=1, field="up"))
    states = tab.run(
        """const { base } = page, positions = new Float32Array(base.positions.length + 3).fill(9);
        positions.set(base.positions);
        page.setMesh(new base.constructor(positions, base.faces, "lone"), 0);
        await page.step(8);
        return [...page.automaton.read()]"""
    )
    assert len(states) == 16 * (len(GIVEN.vertices) + 1)
    assert np.isfinite(states).all() and np.abs(states).max() > 0.05 and tab.errors == []


def test_a_run_that_learns_to_flow_can_be_watched(tmp_path):
    TEXTURES["trained"].save(tmp_path / "a.safetensors")
    data = contents([tmp_path / "a.safetensors"], [GIVEN]).data
    look = data["looks"][0]
    assert (data["field"], look["carried"], look["period"], look["fastest"]) == ("up", True, 4, 4)
