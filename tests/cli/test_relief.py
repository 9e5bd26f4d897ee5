"""`mitex fit relief`, and `mitex apply` of what it makes."""

import json

import numpy as np
import pytest
from PIL import Image

from mitex.asset import Asset
from mitex.cli import main
from mitex.methods.relief import ReliefTexture
from tests.cli import bad_files as bad
from tests.cli.refusals import check_refused
from tests.methods.nca.text.tiny_text import SETTINGS as TEXT_SETTINGS
from tests.methods.relief.waves import waves

pytestmark = pytest.mark.usefixtures("own_cache")
QUICK = (
    "--quiet --set resolution=32 surface_steps=2 faces=200 view=32 width=1 layers=relu1_1 checkpoint_every=1"
)


def maps(folder, *names):
    """A folder with the maps of a known relief."""
    folder.mkdir()
    for name, values in waves(*names).maps.items():
        pixels = np.round(255 * values).astype(np.uint8)
        Image.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels).save(folder / f"{name}.png")


def fit(words="", exemplar="maps", mesh="good.obj", out="out/run", steps=2):
    return (
        f"fit relief --exemplar {exemplar} --mesh {mesh} --out {out} --steps {steps} {QUICK} {words}".split()
    )


def test_fit_resume_apply_render(files, capsys):
    maps(files / "maps", "albedo", "height", "normal")
    assert main(fit()) == 0
    assert capsys.readouterr().out.strip() == "out/run"
    run = files / "out" / "run"
    assert main(["fit", "relief", *fit("--resume", steps=3)[2:]]) == 0
    texture = ReliefTexture.load(run)
    assert texture.about["steps"] == 3 and 0.05 < texture.about["depth"] < 0.12
    assert main(["apply", "out/run", "--mesh", "good.obj", "--out", "out/a.glb", "--untangle"]) == 0
    written = Asset.load(files / "out" / "a.glb")
    assert len(written.mesh.faces) > 12 and written.maps.keys() == {"albedo"}
    assert np.abs(written.mesh.vertices.max(0) - texture.moved.vertices.max(0)).max() < 1e-4
    assert main(["render", "out/a.glb", "--out", "out/a.png", "--resolution", "32", "--spp", "1"]) == 0


def test_from_words_by_a_tile_of_nca(files):
    """The three commands of the guide: words to maps that repeat, and these to a relief."""
    settings = " ".join((*TEXT_SETTINGS, "steps=2"))
    text = f"fit nca --text red --clip words --out out/red --quiet --set {settings}"
    assert main(text.split()) == 0
    assert main(["apply", "out/red", "--tile", "64", "--steps", "2", "--out", "out/tile", "--quiet"]) == 0
    maps = {path.stem for path in (files / "out" / "tile").glob("*.png")}
    assert {"albedo", "height", "normal"} <= maps
    assert main(fit(exemplar="out/tile", out="out/relief")) == 0
    texture = ReliefTexture.load(files / "out" / "relief")
    assert texture.textures.keys() == {"albedo"}
    assert np.abs(texture.moved.vertices - texture.plain.vertices).max() > 0


def test_untangling_starts_from_the_mesh_without_its_relief(files, monkeypatch):
    """As far as that mesh, in place of which `untangled` would have a part of the relief."""
    maps(files / "maps", "height", "normal")
    assert main(fit("--set start=flat")) == 0
    monkeypatch.setattr("mitex.methods.relief.texture.untangled", lambda before, after: before)
    texture = ReliefTexture.load(files / "out" / "run")
    for words, mesh in (([], texture.moved), (["--untangle"], texture.plain)):
        assert main(["apply", "out/run", "--mesh", "good.obj", "--out", "out/a.ply", *words]) == 0
        assert np.abs(Asset.load("out/a.ply").mesh.vertices - mesh.vertices).max() < 1e-4
    assert np.abs(texture.moved.vertices - texture.plain.vertices).max() > 1e-2


def test_scale_and_depth_reach_the_fit(files):
    maps(files / "maps", "height", "normal")
    for out, words in (("a", ""), ("b", "--scale 2"), ("c", "--depth 0.3")):
        assert main(fit(f"--set start=flat {words}", out=f"out/{out}", steps=1)) == 0
    plain, large, deep = (ReliefTexture.load(files / "out" / name) for name in "abc")
    assert plain.about["depth"] == large.about["depth"] != deep.about["depth"] == 0.3
    assert not np.array_equal(plain.moved.vertices, large.moved.vertices)


def test_heights_alone_and_normals_alone(files):
    for name, words in (("height", "--depth 0.09"), ("normal", "")):
        maps(files / name, name)
        assert main(fit(f"--set start=flat {words}", exemplar=name, out=f"out/{name}", steps=1)) == 0
        assert ReliefTexture.load(files / "out" / name).about["depth"] == pytest.approx(0.09, rel=0.1)


@pytest.mark.parametrize(
    ("words", "exemplar", "message"),
    [
        ("", "photo.png", "no height map and no normals"),
        ("", "height", "no normals, which would say how deep"),
        ("", "nowhere", "there is no exemplar"),
        ("--depth 2", "height", "--depth"),
        ("--depth -0.1", "height", "--depth"),
        ("--scale 0", "normal", "--scale"),
        ("--set loss=nearest", "normal", "loss"),
        ("--set faces=0", "normal", "faces"),
        ("--set layers=relu9_9", "normal", "relu9_9"),
        ("--keep-uvs", "normal", "has no UVs"),
        ("--resume", "normal", "no checkpoint"),
        ("--set smoothing=-1", "normal", "smoothing"),
    ],
)
def test_what_is_refused(files, capsys, words, exemplar, message):
    bad.image(files / "photo.png")
    maps(files / "height", "height")
    maps(files / "normal", "normal")
    check_refused(files, fit(words, exemplar), message, capsys)


def test_another_mesh_is_refused(files, capsys):
    maps(files / "normal", "normal")
    assert main(fit("--set start=flat", exemplar="normal", steps=1)) == 0
    capsys.readouterr()
    bad.text(files / "other.obj", bad.CUBE.replace("v 1 1 1", "v 1.5 1 1"))
    check_refused(
        files, ["apply", "out/run", "--mesh", "other.obj", "--out", "a.glb"], "belongs to mesh 'good'", capsys
    )


def test_a_full_record_of_the_steps(files):
    maps(files / "normal", "normal")
    assert main(fit("--set start=flat preview_every=2", exemplar="normal")) == 0
    lines = (files / "out" / "run" / "metrics.jsonl").read_text().splitlines()
    assert [json.loads(line)["step"] for line in lines] == [1, 2]
    assert 0 < json.loads(lines[0])["seen"] <= 1
    assert (files / "out" / "run" / "previews" / "000002.png").is_file()
