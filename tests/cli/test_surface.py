"""`mitex fit surface`, and `mitex apply` of what it makes."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import pytest
import trimesh

from mitex.asset import Asset
from mitex.atlas import unwrap
from mitex.cli import main
from mitex.export import write_asset
from mitex.images import write_image
from mitex.mesh import Mesh
from mitex.training import checkpoint
from tests.cli import bad_files as bad
from tests.cli.refusals import check_refused
from tests.shapes import moebius

pytestmark = pytest.mark.usefixtures("own_cache")
SMALL = "--quiet --set resolution=32 exemplar_size=32 steps=4 checkpoint_every=2 preview_every=0 scales=0"
QUICK = f"{SMALL} start=noise"
FEW_TEXELS = SMALL.replace("resolution=32", "resolution=16")


def fit(words=QUICK, exemplar="good.png", mesh="good.obj", out="out/run"):
    return f"fit surface --exemplar {exemplar} --mesh {mesh} --out {out} {words}".split()


@pytest.fixture(scope="module")
def source(tmp_path_factory, own_cache):
    folder = tmp_path_factory.mktemp("fitted")
    bad.image(folder / "good.png")
    bad.text(folder / "good.obj", bad.CUBE)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(fit()) == 0
    return folder / "out" / "run"


@pytest.fixture
def run(files, source):
    bad.image(files / "good.png")
    return Path(copytree(source, files / "out" / "run"))


def test_a_fit_from_patches_says_where_its_run_is(files, capsys):
    bad.image(files / "good.png")
    assert main(fit(SMALL)) == 0
    assert capsys.readouterr().out.strip() == "out/run"


def test_fit_apply_render(files, run, capsys):
    assert sorted(p.name for p in run.iterdir()) == [
        *("checkpoint.previous.safetensors", "checkpoint.safetensors", "config.toml", "metrics.jsonl"),
        "texture.safetensors",
    ]
    assert main(["apply", "out/run", "--mesh", "good.obj", "--out", "out/a.glb"]) == 0
    scene: Any = trimesh.load(files / "out" / "a.glb", process=False)
    (geometry,) = scene.geometry.values()
    assert geometry.visual.material.baseColorTexture.size == (32, 32)
    cube = Mesh.load(files / "good.obj").vertices
    assert np.allclose(geometry.bounds, [cube.min(0), cube.max(0)], atol=1e-6)
    assert main(["render", "out/a.glb", "--out", "out/a.png", "--resolution", "32", "--spp", "1"]) == 0
    (files / "good.obj").unlink()  # the run has the mesh
    assert main(["apply", "out/run", "--out", "out/a.ply"]) == 0
    assert "out/a.ply" in capsys.readouterr().out
    assert np.allclose(Mesh.load(files / "out" / "a.ply").vertices, cube, atol=1e-6)


def test_resume(files, run):
    assert main(fit("--resume --quiet --set steps=6")) == 0
    assert checkpoint.load(run).step == 6


def test_own_uvs(files, run, capsys):
    cube = Mesh.load(files / "good.obj")
    mesh = replace(cube, uv=unwrap(cube, 32, 2))
    grey = {"albedo": np.full((len(mesh.vertices), 3), 0.5)}
    write_asset(Asset(mesh, grey).baked(32), files / "own.glb")
    assert main(fit(f"{QUICK} --keep-uvs", mesh="own.glb", out="out/own")) == 0


BAD_FITS = {
    "no mesh": (["fit", "surface", "--exemplar", "good.png", "--out", "out/x"], "--mesh"),
    "unknown mesh": (fit(mesh="no.obj"), "no.obj"),
    "damaged mesh": (fit(mesh="cut.obj"), "cut.obj"),
    "unknown exemplar": (fit(exemplar="no.png"), "no.png"),
    "unknown preset": (fit(f"{QUICK} --preset best"), "best"),
    "unknown key": (fit("--set resolutoin=64"), "resolution"),
    "resolution 0": (fit("--resolution 0"), "resolution = 0"),
    "resolution out of range": (fit("--resolution 100000"), "resolution = 100000"),
    "no orientation": (fit(f"{QUICK} --orientation no.npy"), "no.npy"),
    "scale 0": (fit("--scale 0"), "--scale 0 is out of range"),
    "scale NaN": (fit("--scale nan"), "--scale nan"),
    "a scale for no exemplar": (fit(f"{QUICK} --scale 0.1"), "exemplar would be 3 texels wide"),
    "no scale map": (fit(f"{QUICK} --scale-map no.npy"), "no.npy"),
    "no picture": (fit(f"{QUICK} --scale-map good.obj", mesh="own.obj"), "good.obj"),
    "a scale map without UVs": (fit(f"{QUICK} --scale-map good.png"), "no UVs for the scale map"),
    "a black scale map": (fit(f"{QUICK} --scale-map black.png", mesh="own.obj"), "goes from 0 to 0"),
    "a scale map of another mesh": (fit(f"{QUICK} --scale-map ones.npy"), "one for each vertex"),
    "a scale map of a tile": (
        ["fit", "surface", "--exemplar=good.png", "--tile=32", "--scale-map=ones.npy"],
        "--tile and --scale-map contradict",
    ),
    "no VGG-19": (fit(f"{QUICK} --set weights=vgg19"), "VGG-19"),
    "resolution twice": (fit("--resolution 64 --set resolution=32"), "resolution"),
    "steps 0": (fit("--steps 0"), "--steps 0"),
    "unknown layer": (fit("--set layers=relu6_1"), "relu6_1"),
    "unknown frames": (fit("--set frames=straight"), "straight"),
    "unknown weights": (fit("--set weights=resnet"), "resnet"),
    "angle": (fit("--set angle=1000"), "angle"),
    "no UVs to keep": (fit(f"{QUICK} --keep-uvs"), "no UVs to keep"),
    "overlapping UVs": (fit(f"{QUICK} --keep-uvs", mesh="overlap.obj"), "overlap"),
    "UVs outside": (fit(f"{QUICK} --keep-uvs", mesh="outside.obj"), "overlap"),
    "below a file": (fit(out="good.obj/run"), "is a file"),
    "other files": (fit(out="full"), "other files"),
    "nothing to resume": (fit(f"{QUICK} --resume"), "resume"),
}


@pytest.mark.parametrize("name", BAD_FITS)
def test_bad_fits(files, name, capsys):
    bad.image(files / "good.png")
    bad.text(files / "cut.obj", "v 0 0 0\nf 1 2")
    bad.text(files / "full" / "other.txt")
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\n"
    bad.text(files / "overlap.obj", corners + "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf 2/1 4/2 3/3\n")
    bad.text(files / "outside.obj", corners + "vt 0 0\nvt 3 0\nvt 0 2\nf 1/1 2/2 3/3\n")
    bad.text(files / "own.obj", corners + "vt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\nf 1/1 2/2 3/3\nf 2/2 4/4 3/3\n")
    write_image(files / "black.png", np.zeros((4, 4)))
    np.save(files / "ones.npy", np.ones(3))
    words, message = BAD_FITS[name]
    check_refused(files, words, message, capsys)


BAD_APPLIES = {
    "another mesh": ("--mesh other.obj --out out/a.glb", "belongs to mesh 'good', not to 'other'"),
    "seed": ("--mesh good.obj --out out/a.glb --seed 3", "--seed is no option"),
    "resolution": ("--mesh good.obj --out out/a.glb --resolution 64", "--resolution is no option"),
    "vertex colours": ("--mesh good.obj --out out/a.glb --vertex-colours", "--vertex-colours is no option"),
    "subdivide": ("--mesh good.obj --out out/a.glb --subdivide 1", "--subdivide is no option"),
}


@pytest.mark.parametrize("name", BAD_APPLIES)
def test_bad_applies(files, run, name, capsys):
    bad.text(files / "other.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    words, message = BAD_APPLIES[name]
    check_refused(files, ["apply", "out/run", *words.split()], message, capsys)


def test_a_resolution_beyond_memory(files, monkeypatch, capsys):
    bad.image(files / "good.png")
    room = import_module("mitex.methods.surface.fitting")
    monkeypatch.setattr(room, "available_memory", lambda: 10**6)
    check_refused(files, fit("--resolution 512"), "GB of memory", capsys)


def test_a_run_that_is_not_finished(files, run, capsys):
    (run / "texture.safetensors").unlink()
    check_refused(
        files,
        ["apply", "out/run", "--mesh", "good.obj", "--out", "out/a.glb"],
        "which can be resumed",
        capsys,
    )


def test_a_damaged_texture(files, run, capsys):
    bad.cut(run / "texture.safetensors")
    check_refused(files, ["apply", "out/run", "--mesh", "good.obj", "--out", "out/a.glb"], "texture", capsys)


HARD = {
    "zero-area faces": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\n",
    "duplicate vertices": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 4 6 5\n",
    "T-junction": "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 1 0 0\nv 1 -1 0\nf 1 2 3\nf 4 1 5\nf 2 4 5\n",
    "non-manifold edge": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n",
    "one triangle": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "opposite windings": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n",
    "two components": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 1 2 3\nf 4 5 6\n",
    "a sliver": "v 0 0 0\nv 1 0 0\nv 0.5 1e-7 0\nv 0.5 1 0\nf 1 2 3\nf 1 3 4\nf 3 2 4\n",
    "tiny": "v 0 0 0\nv 1e-6 0 0\nv 0 1e-6 0\nf 1 2 3\n",
    "huge": "v 0 0 0\nv 1e6 0 0\nv 0 1e6 0\nf 1 2 3\n",
}


@pytest.mark.parametrize("name", HARD)
def test_hard_meshes_get_a_texture(files, name, capsys):
    bad.image(files / "good.png")
    bad.text(files / "hard.obj", HARD[name])
    assert main(fit(FEW_TEXELS, mesh="hard.obj")) == 0
    assert main(["apply", "out/run", "--mesh", "hard.obj", "--out", "out/a.glb"]) == 0
    output = capsys.readouterr()
    assert all(line.startswith("warning: ") for line in output.err.splitlines())


def test_one_texel(files):
    bad.image(files / "good.png")
    assert main(fit("--quiet --resolution 1 --steps 2 --set scales=0 exemplar_size=32")) == 0


def test_a_moebius_strip(files, capsys):
    strip = moebius()
    trimesh.Trimesh(strip.vertices, strip.faces, process=False).export(files / "strip.obj")
    bad.image(files / "good.png")
    assert main(fit(FEW_TEXELS, mesh="strip.obj")) == 0
    assert main(["apply", "out/run", "--mesh", "strip.obj", "--out", "out/a.glb"]) == 0
    assert "opposite winding" in capsys.readouterr().err
