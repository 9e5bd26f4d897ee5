"""What hands do with the living page: wipe and let it heal, touch, lead its motion, drop files, film."""

import base64

import numpy as np
import pytest
import torch
import trimesh
from imageio_ffmpeg import read_frames
from trimesh.exchange.gltf import export_glb
from trimesh.exchange.ply import export_ply

from mitex.evaluation.metrics import single_image_frechet
from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture, living_page
from mitex.methods.nca.motion.cell_motion import CellMotion
from mitex.methods.nca.motion.condition import cell_vectors, conditions
from mitex.page import quantised
from tests.methods.nca import tiny
from tests.methods.nca.pages import after, states

SPHERE = icosphere(8)  # 642 vertices


@pytest.fixture(scope="module")
def tab(browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "sphere.html"
    living_page(NcaTexture.load("leather"), SPHERE, path, steps=1, subdivide=0)
    return browser.open(path, steps="auto")


def test_wiped_cells_grow_again_as_good_as_before(tab):
    tab.run("page.setMode('albedo'); await page.step(60)")
    before = tab.picture()
    tab.run("page.erase(page.pick(64, 64), 0.8 * page.studio.radius * page.surface.scale)")
    wiped = tab.picture()
    hurt = np.abs(wiped - before).max(2) > 0.02
    tab.run("await page.step(60)")
    exemplar = Exemplar.load("leather").maps["albedo"]
    still, scar, healed = (
        single_image_frechet(exemplar, picture, mask_b=hurt) for picture in (before, wiped, tab.picture())
    )
    assert hurt.mean() > 0.3 and healed < 1.2 * still < 3 * still < scar
    tab.run("page.setMode('light')")


def fingers(tab, *moves):
    """Touches the picture: what each finger does, as a list of its places, shares of the picture's sides."""
    box = tab.page.locator("#picture").bounding_box()
    client = tab.page.context.new_cdp_session(tab.page)
    client.send("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})
    for k, places in enumerate(zip(*moves, strict=True)):
        points = [
            {"x": box["x"] + x * box["width"], "y": box["y"] + y * box["height"], "id": finger}
            for finger, (x, y) in enumerate(places)
        ]
        client.send(
            "Input.dispatchTouchEvent", {"type": "touchMove" if k else "touchStart", "touchPoints": points}
        )
    client.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})


def test_fingers_turn_zoom_and_wipe(tab):
    script = "const { camera } = page.studio; return [camera.azimuth, camera.elevation, camera.distance]"
    azimuth, elevation, distance = tab.run(script)
    fingers(tab, [(0.5, 0.5), (0.6, 0.5), (0.7, 0.6)])
    turned = tab.run(script)
    assert turned[0] < azimuth - 0.2 and turned[1] > elevation + 0.05 and turned[2] == distance
    fingers(tab, [(0.4, 0.5), (0.3, 0.5), (0.2, 0.5)], [(0.6, 0.5), (0.7, 0.5), (0.8, 0.5)])
    near = tab.run(script)
    assert near[:2] == turned[:2] and near[2] < 0.8 * distance
    tab.run("page.studio.camera.fit(); await page.step(1)")
    tab.page.get_by_role("button", name="Erase").click()
    before = tab.array("page.automaton.read()").reshape(len(SPHERE.vertices), -1)
    fingers(tab, [(0.5, 0.5), (0.55, 0.5)])
    wiped = (tab.array("page.automaton.read()").reshape(before.shape) == 0).all(1) & before.any(1)
    assert 3 < wiped.sum() < 0.2 * len(wiped)
    assert tab.run(script)[:2] == turned[:2]


def test_a_moving_texture_is_led(browser, tmp_path):
    texture = NcaTexture(tiny.texture(condition=3, shape=None).look, {"name": "flow", "motion": "right"})
    path = living_page(texture, SPHERE, tmp_path / "flow.html", steps=1, subdivide=0, orientation=30.0)
    tab, mesh = browser.open(path, steps="webgpu"), quantised(SPHERE)
    tab.page.get_by_role("button", name="about y").click()
    tab.page.get_by_role("slider", name="Pace").fill("1.7")
    turn = np.radians(30.0)
    vectors = conditions(cell_vectors(mesh, mesh, "about-y", 1.7), mesh, turn)
    motion = CellMotion(torch.from_numpy(vectors))
    state = after(4, states(texture, mesh, turn=turn, motion=motion)).numpy()
    # As processors take the steps, as graphics cards do, where a thread has one cell, and in WebGL2.
    for way in ("", "page.device.cellsPerThread = 1; page._settle()", "page.device = null; page._settle()"):
        tab.run(f"{way}; page.reset(); await page.step(4)")
        ours = tab.array("page.automaton.read()").reshape(state.shape)
        assert np.abs(ours - state).max() < 1e-3 < np.abs(state).max()
    assert tab.errors == []


def test_without_webgpu_a_page_takes_webgl2(browser, tmp_path):
    path = living_page(tiny.texture(shape=None), SPHERE, tmp_path / "a.html", steps=1, subdivide=0)
    without = "GPUAdapter.prototype.requestDevice = () => Promise.reject(new Error())"
    tab = browser.open(path, steps="auto", before=without)
    assert tab.run("await page.step(2); return [page.device, page.automaton.steps]") == [None, 2]
    asked = browser.open(path, steps="webgpu", before=without)
    asked.page.get_by_text("this browser has no WebGPU").wait_for()


# A file that is dropped onto the page, and what the page shows and says then.
DROP = """const [name, content] = argument;
const files = new DataTransfer();
files.items.add(new File([Uint8Array.from(atob(content), (c) => c.charCodeAt(0))], name));
document.getElementById("status").textContent = "";
document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true }));
const text = () => document.getElementById("status").textContent;
const arrived = () => page.surface.mesh.name === name.split(".")[0] || text();
while (!arrived()) await new Promise((done) => setTimeout(done, 10));
return [page.surface.mesh.name, page.base.count, page.base.faces.length / 3, text()]"""


def dropped(tab, name, content):
    return tab.run(DROP, [name, base64.b64encode(content).decode()])


def test_files_are_dropped(tab):
    box = trimesh.creation.box()
    binary, text, glb = export_ply(box), export_ply(box, encoding="ascii"), export_glb(box)
    for name, content in (
        ("d.glb", glb[:300]),
        ("d.ply", b"ply\n"),
        ("d.obj", b"v 0 0 0\nf 1 2 3\n"),
        ("d.stl", b""),
    ):
        *_, message = dropped(tab, name, content)
        assert name in message, message
    for name, content in (("a.ply", binary), ("b.ply", text), ("c.glb", glb)):
        assert dropped(tab, name, content) == [name[0], 8, 12, ""]
        assert tab.run("return page.surface.mesh.count") == 6146  # after five rounds
    assert tab.picture().std() > 0.02


def test_a_film_shows_the_picture(tab, tmp_path):
    tab.run("page.panel.record()")
    with tab.page.expect_download() as download:
        tab.run(
            """for (let k = 0; k < 6; k++) {
              page.studio.camera.turn(0.2, 0); page.draw();
              await new Promise((done) => setTimeout(done, 60));
            }
            page.draw();  // the last picture once more: a recorder may still hold it back
            await new Promise((done) => setTimeout(done, 300));
            page.panel.record()"""
        )
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    frames = read_frames(str(path), pix_fmt="rgb24")
    size = next(frames)["size"]
    pictures = [np.frombuffer(frame, np.uint8).reshape(*size[::-1], 3) / 255 for frame in frames]
    assert size == (128, 128) and len(pictures) > 1 and path.stem.startswith("leather-")
    assert np.abs(pictures[-1] - tab.picture()).mean() < 0.05 < np.abs(pictures[-1] - pictures[0]).max()
    assert tab.errors == []
