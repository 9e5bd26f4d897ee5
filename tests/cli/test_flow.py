"""The commands doing their work, in small: fit, apply, render, models."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from safetensors.numpy import load_file, save_file

from mitex.asset import Asset
from mitex.cli import main
from mitex.cli.models import listing
from mitex.exemplar import MAPS
from mitex.images import read_image
from tests.cli import bad_files
from tests.cli.refusals import check_refused

pytestmark = pytest.mark.usefixtures("quick_settling")

TINY = [
    *(
        "frequency=4",
        "pool=2",
        "view_count=1",
        "resolution=32",
        "target_size=32",
        "exemplar_size=32",
        "hidden=8",
    ),
    *("min_steps=2", "max_steps=2", "checkpoint_every=1", "preview_every=0", "layers=relu1_1"),
    *("zooms=1", "order_weight=0", "decoder_width=8"),
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bad_files.text(tmp_path / "cube.obj", bad_files.CUBE)
    return tmp_path


def test_fit_apply_render(folder, capsys):
    """From a name to a movie; every command prints the path that it wrote."""

    def run(*words):
        assert main(words) == 0
        return capsys.readouterr().out.splitlines()[-1]

    fit = ["fit", "nca", "--exemplar", "lava", "--seed", "3", "--quiet", "--set", *TINY]
    assert run(*fit, "--steps", "2") == "runs/lava"
    metrics = (folder / "runs/lava/metrics.jsonl").read_text().splitlines()
    assert [json.loads(line)["step"] for line in metrics] == [1, 2]
    assert "seed = 3" in (folder / "runs/lava/config.toml").read_text()
    assert run(*fit, "--steps", "3", "--resume") == "runs/lava"
    assert len((folder / "runs/lava/metrics.jsonl").read_text().splitlines()) == 3
    assert run(*fit, "--steps", "1", "--init", "runs/lava", "--out", "child") == "child"

    apply = ["apply", "runs/lava", "--mesh", "cube.obj", "--subdivide", "2", "--steps", "3", "--seed", "1"]
    assert run(*apply, "--out", "a.glb", "--resolution", "64") == "a.glb"
    baked = Asset.load("a.glb")
    assert set(baked.vertex_maps) == set(MAPS) and baked.atlas is not None
    assert run(*apply, "--out", "new/b.glb", "--vertex-colours", "--orientation", "-90") == "new/b.glb"
    assert Asset.load("new/b.glb").atlas is None
    assert run(*apply, "--out", "c.ply") == "c.ply"
    assert len(Asset.load("c.ply").mesh.faces) == 12
    assert run(*apply, "--out", "d.ply", "--keep-dense") == "d.ply"
    assert len(Asset.load("d.ply").mesh.faces) == 12 * 16
    assert run(*apply, "--out", "d.glb", "--keep-dense", "--resolution", "64") == "d.glb"
    dense = Asset.load("d.glb")
    assert len(dense.mesh.faces) == 12 * 16 and dense.atlas is not None

    assert run(*apply, "--out", "e.glb", "--resolution", "64", "--relief", "0.1") == "e.glb"
    raised = Asset.load("e.glb")
    assert len(raised.mesh.faces) > 12 * 64 and not {"height", "normal"} & set(raised.maps)
    assert not np.isin(np.abs(raised.mesh.vertices).max(axis=1).round(4), [1.0]).all()

    render = ["render", "a.glb", "--resolution", "16", "--spp", "1"]
    assert run(*render, "--out", "a.png", "--azimuth", "-30", "--elevation", "40") == "a.png"
    assert read_image("a.png").shape == (16, 16, 3)
    assert run(*render, "--out", "a.gif", "--frames", "3", "--floating", "--elevation", "-10") == "a.gif"
    assert getattr(Image.open("a.gif"), "n_frames", 1) == 3


@pytest.mark.parametrize("out", ["tile/", "page.html"])
def test_a_field_and_its_speed_reach_tiles_and_pages(folder, monkeypatch, out):
    given = []

    class Reached(Exception):
        """Work would begin now."""

    def stop(*_, **options):
        given.append(options)
        raise Reached

    bad_files.model(folder / "m.safetensors")
    monkeypatch.setattr("mitex.methods.nca.NcaTexture.tile", stop)
    monkeypatch.setattr("mitex.methods.nca.living_page", stop)
    words = "--tile 32" if out == "tile/" else "--mesh cube.obj"
    for speed in (1.0, 2.5):
        with pytest.raises(Reached):
            main(f"apply m.safetensors {words} --out {out} --field up --speed {speed}".split())
        assert (given[-1]["field"], given[-1]["speed"]) == ("up", speed)


def test_a_field_that_is_no_text_is_one_line(folder, capsys):
    """In the description of a model whose states are carried along it."""
    about = {"name": "m", "maps": ["albedo"], "motion": 7, "motion_advection": True}
    tensors = load_file(bad_files.model(folder / "m.safetensors"))
    save_file(tensors, folder / "m.safetensors", {"about": json.dumps(about)})
    words = ["apply", "m.safetensors", "--mesh", "cube.obj", "--out", "a.ply"]
    check_refused(folder, words, "the description in 'm.safetensors' is damaged", capsys)


def test_options_reach_the_library(folder, monkeypatch, capsys):
    """Degrees become radians; what is not given keeps the library's default."""
    options = {}
    bad_files.model(folder / "m.safetensors")
    from mitex.methods.nca import NcaTexture

    real = NcaTexture.apply
    monkeypatch.setattr(
        NcaTexture, "apply", lambda self, mesh, **o: options.update(o) or real(self, mesh, **o)
    )
    words = (
        "apply m.safetensors --mesh cube.obj --out a.ply --subdivide 0 --steps 1 --orientation 90 --seed 5"
    )
    assert main(words.split()) == 0
    expected = {
        "seed": 5,
        "steps": 1,
        "subdivide": 0,
        "orientation": 90,
        "scale": 1.0,
        "exemplar_width": None,
        "field": None,
        "speed": 1.0,
        "displace": False,
    }
    assert options == expected | {"resolution": None, "keep_dense": False}
    assert main([*words.split(), "--keep-dense"]) == 0
    assert options == expected | {"resolution": None, "keep_dense": True}

    monkeypatch.setattr(
        "mitex.render.picture.still", lambda asset, **o: options.update(o) or np.zeros((4, 4, 3))
    )
    options.clear()
    assert main(["render", "a.ply", "--out", "a.png", "--azimuth", "180", "--resolution", "32"]) == 0
    assert options == {
        "resolution": 32,
        "azimuth": 180,
        "displacement": 0.0,
        "floating": False,
    }


def test_models(folder, monkeypatch, capsys):
    monkeypatch.setattr("mitex.training.locate.BUNDLED", folder)
    bad_files.model(folder / "moss.safetensors")
    (folder / "moss.png").touch()
    bad_files.model(folder / "rust.safetensors")
    assert main(["models"]) == 0
    text = capsys.readouterr().out
    assert "moss" in text and "rust" in text and "albedo" in text and str(folder / "moss.png") in text
    assert main(["models", "--json"]) == 0
    models = json.loads(capsys.readouterr().out)
    assert [model["name"] for model in models] == ["moss", "rust"]
    assert models[0]["thumbnail"] == str(folder / "moss.png") and models[1]["thumbnail"] is None
    assert models[0]["path"] == str(folder / "moss.safetensors") and models[0]["maps"] == ["albedo"]


def test_bundled_models_are_listed_with_how_they_were_made(capsys):
    assert main(["models"]) == 0
    out = capsys.readouterr().out
    assert not re.search(r"[1-9]\d*\.\d{5}|\b0\.0*[1-9]\d{4}", out)  # numbers are rounded
    for model in listing():
        assert {"name", "method", "path", "thumbnail", "preset", "steps", "seconds", "loss"} <= set(model)
        assert model["thumbnail"] and (model["method"] == "geometric" or model["maps"])


@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_fit(folder, kind):
    """Ctrl-C ends a real run with code 130, a checkpoint, and no traceback."""
    words = ["fit", "nca", "--exemplar", "lava", "--steps", "100000", "--quiet", "--set", *TINY]
    words[words.index("checkpoint_every=1")] = "checkpoint_every=1000"
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2]), "OMP_NUM_THREADS": "1"}
    running = subprocess.Popen(
        [sys.executable, "-m", "mitex", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )
    metrics = folder / "runs" / "lava" / "metrics.jsonl"
    while running.poll() is None and not (metrics.exists() and metrics.stat().st_size):
        time.sleep(0.05)
    running.send_signal(kind)
    out, err = running.communicate(timeout=120)
    assert running.returncode == 130, err
    assert err.startswith("interrupted after step") and err.count("\n") == 1 and not out
    assert (folder / "runs" / "lava" / "checkpoint.safetensors").exists()
    assert not list((folder / "runs" / "lava").glob("*.tmp*"))
