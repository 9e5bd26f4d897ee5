"""The panel and keys of the living page: views, speed, density, pictures, narrow screens, and no WebGL2."""

import io

import numpy as np
import pytest
from PIL import Image

from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture, living_page

SIDE = 96  # of pictures [px]
BALL = icosphere(8)  # 642 vertices


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "ball.html"
    looks = [NcaTexture.load("lava")]
    return living_page(NcaTexture.load("pebbles"), BALL, path, looks=looks, steps=1, subdivide=0)


@pytest.fixture(scope="module")
def tab(browser, path):
    tab = browser.open(path, SIDE, steps="auto")
    tab.run("await page.step(60)")
    return tab


FRAME = """await new Promise((done) => requestAnimationFrame(() => {
  page.draw();
  requestAnimationFrame(() => requestAnimationFrame(done));
}))"""


def click(tab, name):
    tab.page.get_by_role("button", name=name, exact=True).click()


def test_views_show_the_maps(tab):
    colour, bent, plain, _, ids = (values[::-1] for values in tab.maps())
    hit = ids[..., 0] > 0
    lit = tab.picture()
    for name, expected in {
        "Colour": colour[..., :3],
        "Normal": bent[..., :3] * 0.5 + 0.5,
        "Height": colour[..., 3:],
        "Rough": bent[..., 3:],
        "Occlusion": plain[..., 3:],
    }.items():
        click(tab, name)
        seen = tab.picture()
        assert np.abs(seen - expected)[hit].max() < 0.01, name
        assert np.abs(seen - lit)[hit].max() > 0.1 and np.abs(seen - lit)[~hit].max() < 0.01
    click(tab, "Light")
    assert np.abs(tab.picture() - lit).max() < 0.01
    tab.page.get_by_role("slider", name="Exposure").fill("1")
    assert tab.picture()[hit].mean() > lit[hit].mean() + 0.05
    tab.page.get_by_role("slider", name="Exposure").fill("0")


def test_the_view_of_a_graft_shows_where_it_is(tab):
    tab.page.get_by_role("combobox", name="Graft").select_option(label="lava")
    tab.page.get_by_role("group", name="View").get_by_role("button", name="Graft").click()
    none = tab.picture()
    place = [SIDE // 3, SIDE // 2]
    tab.run("page.graft(page.pick(...argument), 0.5 * page.studio.radius * page.surface.scale)", place)
    change = np.abs(tab.picture() - none).max(2)
    assert change[place[1], place[0]] > 0.3 and change[SIDE // 2, -SIDE // 5 :].max() < 0.01
    tab.page.get_by_role("slider", name="Everywhere").fill("100")
    assert (np.abs(tab.picture() - none).max(2) > 0.3).mean() > 0.3
    tab.page.get_by_role("combobox", name="Graft").select_option(label="nothing")
    tab.run("page.panel.show('light'); page.setShare(0)")


def test_the_slider_subdivides_the_mesh(tab):
    tab.page.get_by_role("slider", name="Subdivide").fill("1")
    assert tab.run("return page.surface.mesh.count") == 4 * len(BALL.vertices) - 6
    tab.run("await page.step(60)")
    assert tab.picture().std() > 0.05
    tab.page.get_by_role("slider", name="Subdivide").fill("0")
    assert tab.run("return [page.surface.mesh.count, page.automaton.steps]") == [len(BALL.vertices), 0]
    tab.run("await page.step(60)")


def test_keys_do_what_the_panel_says(tab):
    keys = tab.page.keyboard
    tab.page.locator("#picture").focus()
    before = tab.picture()
    view = "const { camera } = page.studio; return [camera.azimuth, camera.elevation, camera.distance]"
    start = tab.run(view)
    for key in ("ArrowLeft", "ArrowUp", "+"):
        keys.press(key)
    turned = tab.run(view)
    assert turned[0] < start[0] and turned[1] > start[1] and turned[2] < start[2]
    assert np.abs(tab.picture() - before).max() > 0.1
    for key, state in {"e": "erase", "t": "turn"}.items():
        keys.press(key)
        assert tab.run("return page.panel.pointer.tool") == state
    brush = tab.run("return page.radius")
    keys.press("]")
    assert tab.run("return page.radius") > brush
    keys.press("2")
    assert tab.run("return page.studio.mode") == 1
    keys.press("1")
    seed = tab.run("return page.seed")
    keys.press("n")
    assert tab.run("return [page.seed === argument, page.automaton.steps]", seed) == [False, 0]
    assert not tab.array("page.automaton.read()").any()
    keys.press(" ")
    assert tab.page.get_by_role("button", name="Play", exact=True).count() == 1
    keys.press(" ")
    tab.run("await page.step(60); page.studio.camera.fit()")


def test_a_picture_is_saved_as_it_is_shown(tab):
    with tab.page.expect_download() as download:
        click(tab, "Picture")
    image = Image.open(io.BytesIO(download.value.path().read_bytes()))
    assert download.value.suggested_filename == "pebbles-icosphere8.png" and image.size == (SIDE, SIDE)
    tab.run("page.samples = 2")
    assert np.abs(np.asarray(image.convert("RGB")) / 255 - tab.picture()).max() < 0.01
    tab.run("page.samples = 1")


def test_the_clock_takes_steps_until_it_is_paused(tab):
    taken = tab.run(
        """const { clock } = page.panel; page.reset(); clock.rate = 480;
        const time = (ms) => { clock.frame(ms); return new Promise((done) => setTimeout(done, 30)); };
        const next = window.requestAnimationFrame;
        window.requestAnimationFrame = () => 0;
        clock.last = 0; clock.playing = true;
        for (let k = 1; k <= 5; k++) { await time(20 * k); while (page.automaton.busy) await time(20 * k); }
        const moving = page.automaton.steps; clock.playing = false;
        await time(200); await time(300);
        window.requestAnimationFrame = next;
        return [moving, page.automaton.steps, page.changed]"""
    )
    assert 30 <= taken[0] <= 60 and taken[1] == taken[0] and not taken[2]
    assert tab.picture().std() > 0.05


@pytest.mark.parametrize("size", [(390, 844), (820, 1180)])
def test_narrow_screens_have_all_of_it(tab, size):
    page = tab.page
    page.set_viewport_size({"width": size[0], "height": size[1]})
    boxes = [page.locator(place).bounding_box() for place in ("#picture", "#panel")]
    assert boxes[0]["width"] * boxes[0]["height"] > 0.4 * size[0] * size[1]
    for box in boxes:
        assert box["x"] >= 0 and box["x"] + box["width"] <= size[0] and box["y"] + box["height"] <= size[1]
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    cut = """[...document.querySelectorAll("#panel button, #panel h2, #panel .slider span")]
      .filter((one) => one.scrollWidth > one.clientWidth + 1).map((one) => one.textContent)"""
    assert page.evaluate(cut) == []
    x, y, width, height = (int(boxes[0][key]) for key in ("x", "y", "width", "height"))
    for _ in range(5):  # what is drawn may not have reached the screen at the first look
        tab.run(FRAME)
        shown = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")) / 255
        spread = shown[y : y + height, x : x + width].std()
        if spread > 0.02:
            break
    assert shown.shape[:2] == size[::-1] and spread > 0.02


def test_without_webgl2_the_page_says_so_and_shows_a_picture(browser, path):
    tab = browser.open(path, before="HTMLCanvasElement.prototype.getContext = () => null")
    tab.page.get_by_text("this browser has no WebGL2").wait_for()
    assert (
        tab.page.locator("#instead img").evaluate("image => image.decode().then(() => image.naturalWidth)")
        == 384
    )
    shown = Image.open(io.BytesIO(tab.page.locator("#instead img").screenshot()))
    assert np.std(np.asarray(shown.convert("RGB")) / 255) > 0.05
    assert not tab.page.locator("#panel").is_visible()
