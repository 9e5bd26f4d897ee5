"""`mitex demo`, at toy size."""

from dataclasses import replace

import numpy as np
import pytest

from mitex import demo
from mitex.cli import main
from mitex.exemplar import Exemplar
from mitex.exemplar import names as exemplar_names
from mitex.images import read_image
from mitex.mesh import embedded_names, icosphere
from mitex.methods import surface
from mitex.methods.nca import NcaTexture
from mitex.training.locate import CHECKPOINT, PREVIOUS

TINY = (
    *("resolution=32", "exemplar_size=32", "steps=2", "scales=0", "weights=random", "preview_every=0"),
    *("start=noise", "layers=relu1_1"),
)


def test_what_it_shows_is_there():
    """Exemplars and meshes that ship with Mitex; models with an exemplar to put beside them."""
    assert demo.EXEMPLAR in exemplar_names()
    assert set(demo.MAPS) <= Exemplar.load(demo.EXEMPLAR).maps.keys()
    assert {demo.MESH, *demo.MODELS.values()} <= set(embedded_names())
    assert all(NcaTexture.load(model).about["exemplar"] in exemplar_names() for model in demo.MODELS)


def test_it_leaves_assets_pictures_and_a_sheet(tmp_path, monkeypatch, capfd):
    """The second call goes on from the first, and gives the same pictures; balls stand in for the meshes."""
    grow = NcaTexture.apply
    monkeypatch.chdir(tmp_path)
    fit = surface.fit
    monkeypatch.setattr(surface, "fit", lambda *a, set, **o: fit(*a, **o, set=[*set, *TINY]))
    monkeypatch.setattr("mitex.mesh.load.embedded", lambda name: replace(icosphere(6), name=name))
    monkeypatch.setattr(demo, "MESH", "mushrooms")
    monkeypatch.setattr(demo, "MODELS", {"lava": "knot"})
    monkeypatch.setattr(demo, "RESOLUTION", 64)
    monkeypatch.setattr(demo, "SIZE", 16)
    monkeypatch.setattr(demo, "SAMPLES", 1)
    monkeypatch.setattr(NcaTexture, "apply", lambda *a, **o: grow(*a, **o, subdivide=0, steps=2))
    sheets = []
    for quiet in ([], ["--quiet"]):
        assert main(["demo", "--out", "shown", *quiet]) == 0
        files, said = capfd.readouterr()
        assert files.splitlines()[0].endswith("shown/mushrooms.glb")
        assert bool(said) != bool(quiet) and ("growing 'lava' on knot" in said) != bool(quiet)
        sheets.append((tmp_path / "shown" / "demo.png").read_bytes())
    assert sheets[0] == sheets[1]
    names = {path.name for path in (tmp_path / "shown").iterdir()}
    assert names == {"run", "mushrooms.glb", "mushrooms.png", "knot.glb", "knot.png", "demo.png"}
    height, width, _ = read_image(tmp_path / "shown" / "demo.png").shape
    assert width > 4 * 16 and 16 < height < 32  # exemplar and picture, twice


class Stopped(Exception):
    """At the synthesis."""


@pytest.mark.parametrize("left", [None, CHECKPOINT, PREVIOUS])
def test_a_run_in_the_folder_is_continued(tmp_path, monkeypatch, left):
    """Also below `~`, and when the process was killed between the two renames of a checkpoint."""
    monkeypatch.setenv("HOME", str(tmp_path))
    run = tmp_path / "demo" / "run"
    run.mkdir(parents=True)
    if left:
        (run / left).touch()
    options = {}

    def fit(exemplar, mesh, out, **keywords):
        options.update(keywords, out=out)
        raise Stopped

    monkeypatch.setattr(surface, "fit", fit)
    with pytest.raises(Stopped):
        demo.demo(demo.Path("~/demo"), seed=0)
    assert options["out"] == run and options["resume"] == bool(left)


def test_the_seed_reaches_the_synthesis_and_the_models(tmp_path, monkeypatch, capsys):
    made = []

    class Synthesized:
        def apply(self):
            return "vase"

    def fit(exemplar, mesh, out, **options):
        made.append((mesh, options["seed"], options["resume"]))
        return Synthesized()

    def put(asset, source, mesh, out):
        picture = np.zeros((16, 16, 3), np.float32)
        return demo.Piece(source, mesh, picture, picture, [out / f"{mesh}.glb"])

    monkeypatch.setattr(surface, "fit", fit)
    monkeypatch.setattr(NcaTexture, "apply", lambda _, mesh, **options: made.append((mesh.name, options)))
    monkeypatch.setattr(demo, "_put", put)
    monkeypatch.setattr(demo, "MODELS", {"lava": "knot", "ceramic": "octopus"})
    assert main(["demo", "--out", str(tmp_path), "--seed", "7", "--quiet"]) == 0
    grown = {"seed": 7, "resolution": demo.RESOLUTION}
    assert made == [("vase", 7, False), ("knot", grown), ("octopus", grown)]
    names = [line.rpartition("/")[2] for line in capsys.readouterr().out.splitlines()]
    assert names == ["vase.glb", "knot.glb", "octopus.glb", "demo.png"]


@pytest.mark.parametrize("seed", ["-1", "4294967296"])
def test_a_seed_out_of_range(seed, tmp_path, capsys):
    assert main(["demo", "--out", str(tmp_path / "out"), "--seed", seed]) == 2
    assert f"--seed {seed} is out of range" in capsys.readouterr().err and not (tmp_path / "out").exists()
