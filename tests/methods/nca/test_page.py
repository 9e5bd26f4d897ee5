"""The living page in a browser: its states and its pixels against Python's."""

from unittest.mock import patch

import numpy as np
import pytest
import torch
import trimesh
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from mitex.errors import ConfigError, OutputError
from mitex.images import bilinear
from mitex.mesh import Mesh, icosphere, subdivide_midpoint, torus
from mitex.methods.nca import NcaTexture, living_page
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.graft import GraftedGrowth
from mitex.page import quantised
from tests.methods.nca.pages import after, points, shown, states
from tests.node import khronos_reports
from tests.page.hashes import mask

SEED, TURN = 3, 40.0


@pytest.fixture(scope="module")
def texture():
    return NcaTexture.load("pebbles")


@pytest.fixture(scope="module")
def cells():
    """The page's automaton's mesh."""
    return subdivide_midpoint(quantised(torus(12, 6)), 1)


@pytest.fixture(scope="module")
def path(texture, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "torus.html"
    looks = [NcaTexture.load("lava")]
    return living_page(
        texture, torus(12, 6), path, looks=looks, seed=SEED, steps=1, subdivide=1, orientation=TURN
    )


@pytest.fixture(scope="module")
def tab(browser, path):
    return browser.open(path)


@pytest.fixture(scope="module")
def grown(tab, texture, cells):
    """The page's state after 200 steps, and Python's; those after 16 are compared on the way."""
    every = states(texture, cells, SEED, np.radians(TURN))
    early = after(16, every)
    assert early.abs().max() > 0.3
    tab.run("page.reset(); await page.step(16)")
    assert (state(tab, cells) - early).abs().max() < 1e-3
    tab.run("await page.step(184)")
    return state(tab, cells), after(184, every)


def state(tab, cells):
    """The page's states, (V, C)."""
    return torch.from_numpy(tab.array("page.automaton.read()").copy()).reshape(len(cells.vertices), -1)


def test_states_are_those_of_python(grown):
    ours, theirs = grown
    # Rounding grows where a pattern can tip over; a cell in a hundred may show it after so many steps.
    assert ((ours - theirs).abs().amax(1) < 0.05).float().mean() > 0.99


@pytest.fixture(scope="module")
def compute(browser, path):
    """The page with WebGPU."""
    tab = browser.open(path, steps="webgpu")
    assert tab.run("return page.automaton.device === page.device && page.device instanceof GPUDevice")
    return tab


def test_webgpu_takes_the_same_steps(compute, tab, texture, cells, grown):
    early = after(16, states(texture, cells, SEED, np.radians(TURN)))
    compute.run("await page.step(16)")
    assert (state(compute, cells) - early).abs().max() < 1e-3
    compute.run("await page.step(184)")
    assert np.abs(compute.picture() - tab.picture()).mean() < 2e-3


# The orientation of the steps, and a seed and a brush while steps are on their way.
SCRIPT = """page.orient(1); const late = page.step(20); page.reset(5); await late; await page.step(20);
const more = page.step(5); const erased = page.erase({ face: 7, barycentric: [0.3, 0.3, 0.4] }, 0.5);
await more; const wiped = page.automaton.read(); await page.step(3);
return erased.every((v) => wiped.subarray(16 * v, 16 * v + 16).every((x) => x === 0))"""


def test_pixels_are_those_of_python(tab, texture, cells, grown):
    colour, bent, plain, _, ids = tab.maps()
    hit = ids[..., 0] > 0
    assert 0.2 < hit.mean() < 0.8
    maps, normals = shown(texture, grown[0], cells, np.radians(TURN), ids[hit])
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


@pytest.mark.parametrize("azimuth", [0.4, 2.5, 4.6])
def test_the_brush_is_where_the_pixel_looks(tab, cells, azimuth):
    camera = tab.run(
        """page.studio.camera.azimuth = argument; page.studio.camera.fit(); page.draw();
        const { camera } = page.studio; const { right, up, back } = camera.axes();
        return [camera.eye, right, up, back, camera.slopes(1), page.surface.centre, page.surface.scale]""",
        azimuth,
    )
    rows, columns = np.nonzero(tab.maps()[-1][..., 0])
    for k in np.linspace(0, len(rows) - 1, 7).astype(int)[1:-1]:
        point = tab.run("return page.pick(...argument)", [int(columns[k]), int(127 - rows[k])])
        corners = cells.vertices[cells.faces[point["face"]]].astype(float)
        place = (np.asarray(point["barycentric"]) @ corners - camera[5]) / camera[6]
        eye, right, up, back, slopes = map(np.asarray, camera[:5])
        along = -(place - eye) @ back
        seen = np.array([(place - eye) @ right, (place - eye) @ up]) / (along * slopes)
        pixel = np.array([columns[k] + 0.5, rows[k] + 0.5]) / 64 - 1
        assert np.abs(seen - pixel).max() < 0.25 / 64  # a quarter of a pixel: graphics cards round corners
        # The rounding moves places that are seen at a grazing angle further along the ray.
        assert np.linalg.norm(place - eye) < np.linalg.norm(nearest_hit(cells, camera, *pixel) - eye) + 0.05


def nearest_hit(mesh, camera, x, y):
    """Where the ray through a place of the picture meets the mesh first."""
    eye, right, up, back, slopes, centre, scale = map(np.asarray, camera)
    way = x * slopes[0] * right + y * slopes[1] * up - back
    a, b, c = ((mesh.vertices[mesh.faces[:, k]].astype(float) - centre) / scale for k in range(3))
    # Cramer's rule for eye + t way = a + u (b - a) + v (c - a).
    solved = np.linalg.solve(
        np.stack([b - a, c - a, np.broadcast_to(-way, a.shape)], 2), (eye - a)[..., None]
    )
    u, v, t = solved[..., 0].T
    t = np.where((u >= 0) & (v >= 0) & (u + v <= 1), t, np.inf)
    return eye + t.min() * way


def test_erased_cells_are_the_seed_and_grow_again(tab, cells):
    rows, columns = np.nonzero(tab.maps()[-1][..., 0])
    middle = [int(columns[len(rows) // 3]), int(127 - rows[len(rows) // 3])]
    # A ball as wide as the tube would reach its other side, which no path of this length does.
    erased = tab.run("return page.erase(page.pick(...argument), 0.85)", middle)
    wiped = state(tab, cells).numpy()
    assert (wiped[erased] == 0).all() and (np.delete(wiped, erased, 0) != 0).any(1).all()
    graph, points = cells.edges, cells.vertices[cells.edges.indices] - cells.vertices[cells.edges.rows]
    lengths = csr_array((np.linalg.norm(points, axis=1), graph.indices, graph.indptr))
    paths = dijkstra(lengths, indices=erased)[:, erased]
    assert len(erased) > 10 and paths.max() < 2.2 * 0.85 * 1.15
    tab.run("await page.step(40)")
    assert (state(tab, cells)[erased] != 0).any(1).all()


@torch.no_grad()
def test_grafted_looks_share_their_steps_and_their_pictures(tab, compute, texture, cells):
    tab.run("page.setGraft(1); page.reset(); await page.step(30)")
    before = state(tab, cells)
    weights = np.clip(0.5 + cells.vertices[:, 0], 0, 1)
    cells_ = Cells(cells, 0, cells)
    first, second = (look.growth(cells_, np.radians(TURN)) for look in (texture, NcaTexture.load("lava")))
    graft = GraftedGrowth(first, second, weights)
    tab.run("page._shares(Float32Array.from(argument)); await page.step(1)", weights.tolist())
    fires = torch.from_numpy(mask(len(weights), 30, SEED))[None]
    with patch("torch.rand", lambda *_, **__: 1 - fires.float()):
        expected = graft._step(before[None], torch.Generator())[0]
    now = state(tab, cells)
    assert (now - expected).abs().max() < 1e-4
    script = """const { automaton, looks } = page; const [shares, states] = argument;
    automaton.setLooks(...looks); page._shares(Float32Array.from(shares));
    automaton.write(Float32Array.from(states)); automaton.steps = 30; await page.step(1)"""
    compute.run(script, [weights.tolist(), before.ravel().tolist()])
    assert (state(compute, cells) - expected).abs().max() < 1e-4
    colour, *_, ids = tab.maps()
    hit = ids[..., 0] > 0
    values = graft.texture(now).values(*points(ids[hit]))
    assert np.abs(colour[hit][:, :3] - values[:, :3]).max() < 4e-3
    tab.run("page.setGraft(null); page.setShare(0)")


def test_a_downloaded_asset_shows_what_the_page_shows(tab, texture, cells, tmp_path):
    path = tmp_path / "torus.glb"
    path.write_bytes(tab.array("await page.glb(256)").tobytes())
    mesh = Mesh.load(path)
    assert len(mesh.faces) == len(cells.faces)
    assert np.abs(mesh.vertices[mesh.faces] - cells.vertices[cells.faces]).max() < 1e-6
    scene = trimesh.load_scene(path, process=False)
    (geometry,) = scene.geometry.values()
    material = geometry.visual.material
    image, normals = (
        np.asarray(one.convert("RGB")) / 255 for one in (material.baseColorTexture, material.normalTexture)
    )
    assert normals[..., 2].min() > 0.5  # none points inwards
    faces = np.arange(len(cells.faces), dtype=np.int32)
    middles = np.full((len(faces), 3), 1 / 3, np.float32)
    grown = GrownTexture(
        texture.look, state(tab, cells), Cells(cells, 0, cells), np.radians(TURN), texture._palette
    )
    expected = grown.maps(grown.values(faces, middles))["albedo"]
    uv = geometry.visual.uv.reshape(-1, 3, 2).mean(axis=1)  # trimesh has v upwards
    baked = bilinear(image, uv)
    assert np.abs(baked - expected).mean() < 0.02 < expected.std()


def test_a_downloaded_asset_is_valid(tab, tmp_path):
    path = tmp_path / "torus.glb"
    path.write_bytes(tab.array("await page.glb(128)").tobytes())
    (report,) = khronos_reports([path])
    assert [issue for issue in report["issues"]["messages"] if issue["severity"] < 2] == []


def test_a_device_that_is_lost_is_not_missed(compute, cells):
    compute.run("page.automaton.setLooks(page.look)")
    assert compute.run(SCRIPT)
    before = state(compute, cells)
    compute.run("page.device.destroy(); await page.device.lost")
    assert compute.run("return [page.device, page.automaton.steps]") == [None, 28]
    assert torch.equal(state(compute, cells), before)
    compute.run("page.orient(0)")
    assert compute.run(SCRIPT)  # now in WebGL2
    assert (state(compute, cells) - before).abs().max() < 1e-3 < before.abs().max()
    assert compute.errors == []


HOSTILE = "<img src=x onerror=window.attacked=1></script><script>window.attacked=1</script>"


def test_a_dropped_mesh_is_grown_on_and_its_name_is_text(tab):
    obj = "\n".join(
        [f"v {x} {y} {z}" for x, y, z in icosphere(2).vertices]
        + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in icosphere(2).faces]
    )
    count = tab.run(
        """page.panel.open(new File([argument[0]], argument[1] + ".obj"));
        while (page.surface.mesh.name === "torus") await new Promise((done) => setTimeout(done, 20));
        return [page.base.count, page.levels, page.surface.mesh.count,
                document.querySelector("h1").textContent, window.attacked ?? null]""",
        [obj, HOSTILE],
    )
    assert count == [42, 4, len(subdivide_midpoint(icosphere(2), 4).vertices), HOSTILE, None]
    assert tab.picture().std() > 0.02


def test_nothing_is_fetched_and_nothing_goes_wrong(tab):
    assert (
        tab.errors == [] and len([url for url in tab.requests if not url.startswith(("data:", "blob:"))]) == 1
    )


def test_what_a_page_cannot_follow_is_refused(texture, tmp_path):
    with pytest.raises(ConfigError, match="there is no vector field 'sideways'"):
        living_page(texture, torus(8, 6), tmp_path / "a.html", orientation="sideways")
    with pytest.raises(ConfigError, match="for each vertex"):
        living_page(texture, torus(8, 6), tmp_path / "a.html", orientation=np.ones((5, 3)))
    with pytest.raises(ConfigError, match="there is no vector field 'sideways'"):
        living_page(texture, torus(8, 6), tmp_path / "a.html", field="sideways")
    with pytest.raises(ConfigError, match="stands still"):
        living_page(texture, torus(8, 6), tmp_path / "a.html", speed=2.0)
    with pytest.raises(OutputError):
        living_page(texture, torus(8, 6), tmp_path / "a.htm")
    assert list(tmp_path.iterdir()) == []
