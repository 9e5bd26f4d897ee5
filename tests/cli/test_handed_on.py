"""What `mitex apply` and `mitex render` hand on to the library, option by option."""

import pytest

from mitex.asset import Asset, clay
from mitex.mesh import Mesh
from tests.cli.handing_on import handed_on
from tests.cli.refusals import apply

GROWTH = {"subdivide": "auto", "orientation": 0, "scale": 1, "field": None, "speed": 1}
BAKED = {"seed": 0, "steps": None, "resolution": 1024, **GROWTH}


@pytest.mark.parametrize(
    ("words", "given"),
    [
        ("--exemplar-width 0.3", {"exemplar_width": 0.3}),
        ("--scale 2.5", {"scale": 2.5}),
        ("--keep-dense --displace", {"keep_dense": True, "displace": True}),
        ("--vertex-colours", {"resolution": None}),
        ("--resolution 64 --steps 9 --subdivide 1", {"resolution": 64, "steps": 9, "subdivide": 1}),
    ],
)
def test_growth_on_a_mesh(files, monkeypatch, words, given):
    _, options = handed_on(monkeypatch, "mitex.methods.nca.NcaTexture.apply", apply(words))
    assert options == {**BAKED, "exemplar_width": None, "keep_dense": False, "displace": False, **given}


def test_tile(files, monkeypatch):
    words = "--tile 64 --tile-cells 8 --seed 4 --steps 3"
    words = f"apply pebbles --out out/tile {words}".split()
    (_, side), options = handed_on(monkeypatch, "mitex.methods.nca.NcaTexture.tile", words)
    assert side == 64
    assert options == {"cells": 8, "seed": 4, "steps": 3, "field": None, "speed": 1}


def test_page(files, monkeypatch):
    words = "--looks lava,knit --seed 4 --steps 3 --subdivide 2 --scale 1.5 --orientation 30"
    words = apply(words, out="out/page.html")
    (texture, mesh, out), options = handed_on(monkeypatch, "mitex.methods.nca.living_page", words)
    assert (texture.about["name"], mesh.name) == ("pebbles", "good")
    assert out == files / "out" / "page.html"
    assert [look.about["name"] for look in options.pop("looks")] == ["lava", "knit"]
    given = {"seed": 4, "steps": 3, "subdivide": 2, "scale": 1.5, "orientation": 30}
    assert options == GROWTH | given


# What stills and turntables are given; the defaults of other options differ, and are left to the library.
PICTURED = "--resolution 32 --spp 3 --elevation -40 --displacement 0.1 --exposure -1.5 --floating"
GIVEN = {
    **{"resolution": 32, "spp": 3, "elevation": -40, "displacement": 0.1, "exposure": -1.5},
    "floating": True,
}
PLAIN = {"displacement": 0, "exposure": 0, "floating": False}


def rendered(target, words, files, monkeypatch):
    """Options of a picture of a small asset, with the name of the file that it goes to."""
    clay(Mesh.load("good.obj")).export("a.ply")
    (asset, out), options = handed_on(monkeypatch, target, f"render a.ply {words}".split())
    assert isinstance(asset, Asset)
    return options, str(out.relative_to(files))


@pytest.mark.parametrize(
    ("words", "given"), [("", PLAIN), (f"{PICTURED} --azimuth 70", {**GIVEN, "azimuth": 70})]
)
def test_still(files, monkeypatch, words, given):
    words = f"--out out/a.png {words}"
    assert rendered("mitex.asset.Asset.render", words, files, monkeypatch) == (given, "out/a.png")


@pytest.mark.parametrize(
    ("words", "given"),
    [("", PLAIN), (f"{PICTURED} --frames 5 --fps 7", {**GIVEN, "frames": 5, "fps": 7})],
)
def test_turntable(files, monkeypatch, words, given):
    words = f"--out out/a.mp4 {words}"
    assert rendered("mitex.render.turntable", words, files, monkeypatch) == (given, "out/a.mp4")
