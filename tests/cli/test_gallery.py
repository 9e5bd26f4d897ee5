"""`mitex gallery`: every bundled model with its picture, and one click to see it grow, or stand."""

import numpy as np
import pytest

from mitex.cli.entry import main
from mitex.cli.models import listing
from mitex.mesh import icosphere


@pytest.fixture(scope="module")
def tab(browser, tmp_path_factory):
    """The page, whose reliefs are laid from patches of few places."""
    folder = tmp_path_factory.mktemp("gallery")
    mesh = folder / "ball.ply"
    mesh.write_bytes(ball())
    out = folder / "gallery.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitex.methods.geometric.coarse_patches.PLACES", 20)
        assert main(["gallery", "--mesh", str(mesh), "--out", str(out), "--quiet"]) == 0
    assert out.stat().st_size < 3_000_000
    return browser.open(out, 96)


def ball():
    """A sphere as a PLY of text."""
    mesh = icosphere(4)
    lines = ["ply", "format ascii 1.0", f"element vertex {len(mesh.vertices)}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(str, row)) for row in mesh.vertices] + [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
    return "\n".join(lines).encode()


def test_every_model_has_a_picture_to_click(tab):
    names = {model["name"] for model in listing()}
    assert set(tab.page.locator(".gallery span").all_inner_texts()) == names
    pictures = tab.page.locator(".gallery img")
    assert pictures.count() == len(names)
    assert all(
        pictures.nth(k).evaluate("image => image.decode().then(() => image.naturalWidth)") > 99
        for k in (0, 17)
    )


def test_a_click_shows_a_geometric_texture_and_another_one_grows_on(tab):
    """The relief is the mesh itself: its shading varies where the ring's own is smooth. Each is on a ring as
    fine as what it learned: on the coarsest, which it splits twice, on a finer one, split once, or on the
    finest, which stays as it is."""
    tab.run("page.setMesh(page.base, 1); await page.step(20)")
    states = tab.array("page.automaton.read()")
    grown = tab.picture()
    coarsest, finer, finest = 16 * 2 * 24 * 10, 4 * 2 * 96 * 40, 2 * 160 * 64
    for name, faces in (("scales", finest), ("knobs", finer), ("spikes", coarsest)):
        tab.page.locator(".gallery button", has_text=name).click()
        tab.run(
            "while (page.panel.page.look.name !== argument) await new Promise((go) => setTimeout(go, 10))",
            name,
        )
        size = tab.run("return page.panel.page.surface.faceCount")
        pixels = tab.array("page.panel.page.pixels()").reshape(96, 96, 4)[::-1, :, :3] / 255
        assert size == faces and np.abs(pixels - grown).mean() > 0.02
        shade = np.abs(np.diff(pixels[:, :, 0], axis=1))
        assert (shade > 0.05).mean() > 0.03
        assert tab.page.locator(".gallery [aria-pressed=true]").inner_text() == name
        assert tab.page.get_by_role("button", name="Regrow").count() == 0
    tab.page.locator(".gallery button", has_text=tab.run("return page.look.name")).click()
    assert np.array_equal(tab.array("page.automaton.read()"), states)
    tab.run("page.draw()")
    assert np.abs(tab.picture() - grown).max() < 0.05 and tab.errors == []


@pytest.mark.parametrize(
    ("words", "names"), [("", ["knot", "shaderball", "octopus"]), ("--mesh good.obj", ["good"])]
)
def test_the_meshes(files, monkeypatch, words, names):
    shown = []
    monkeypatch.setattr("mitex.page.Content.write", lambda content, out: shown.append((content.data, out)))
    model = {"name": "lava", "method": "nca", "thumbnail": None}
    monkeypatch.setattr("mitex.cli.gallery.listing", lambda: [model])
    assert main(f"gallery --out out/a.html {words}".split()) == 0
    data, out = shown[0]
    assert [mesh["name"] for mesh in data["meshes"]] == names
    assert [look["name"] for look in data["looks"]] == ["lava"] and data["thumbnails"] == [None]
    assert out == files / "out" / "a.html"
