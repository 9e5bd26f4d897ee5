"""`mitex animate` and `mitex graft` for automata's textures."""

import imageio.v3 as iio
import numpy as np
import pytest

from mitex.asset import Asset
from mitex.cli import main
from mitex.mesh import Mesh
from mitex.methods.nca import Graft, NcaTexture
from tests.cli import bad_files as bad
from tests.cli.refusals import check_refused

pytestmark = pytest.mark.usefixtures("own_cache")


def animate(words="", out="out/film/", mesh="good.obj", model="waffle"):
    small = "--seconds 0.5 --fps 4 --resolution 16 --subdivide 0"
    return f"animate {model} --mesh {mesh} --out {out} {small} {words}".split()


def graft(words="--weights y", out="out/a.ply", mesh="good.obj", models="waffle lava"):
    return f"graft {models} --mesh {mesh} --out {out} {words}".split()


def pictures(files, name="film"):
    return np.stack([iio.imread(path) for path in sorted((files / "out" / name).iterdir())]).astype(int)


def test_a_film_of_each_kind(files, capsys):
    for out in ("out/a.mp4", "out/a.gif", "out/film/"):
        assert main(animate(out=out)) == 0 and capsys.readouterr().out.strip() == out
    assert len(iio.imread("out/a.mp4")) == len(iio.imread("out/a.gif")) == len(pictures(files)) == 2
    assert not [path for path in (files / "out").iterdir() if path.name.startswith(".")]


def test_options_reach_the_film(files, monkeypatch):
    calls = []
    monkeypatch.setattr(NcaTexture, "animate", lambda *_, **options: calls.append(options))
    words = "--steps-per-frame 5 --start 7 --renderer path --spp 3 --azimuth 1 --elevation 2 --loop --fade 1 "
    words += "--damage y:0: --damage-at 0.25 --seed 4 --orientation 6 --scale 2 --field up --speed 2 --resume"
    assert main(animate(words)) == main(animate("--loop --fade 0")) == main(animate()) == 0
    options, loop, still = calls
    assert options == {
        **{"seconds": 0.5, "fps": 4, "resolution": 16, "steps_per_frame": 5, "start": 7},
        **{"renderer": "path", "spp": 3, "azimuth": 1, "elevation": 2, "loop": 1},
        **{"damage": "y:0:", "damage_at": 0.25, "seed": 4, "orientation": 6, "scale": 2, "subdivide": 0},
        **{"field": "up", "speed": 2, "resume": True},
    }
    assert loop["loop"] == 0 and still["loop"] is None and still["renderer"] == "preview"


def test_a_graft_is_filmed(files):
    """Where the weight is 1, it is the second texture alone, as it moves."""
    for out, more in (
        ("both", "--graft lava --weights 1"),
        ("first", "--graft lava --weights 0"),
        ("film", ""),
    ):
        words = f"--start 8 --field right --speed 2 {more}"
        assert main(animate(words, f"out/{out}/", model="lava" if out == "film" else "waffle")) == 0
    both, first, alone = (pictures(files, name) for name in ("both", "first", "film"))
    assert np.array_equal(both, alone) and np.abs(first - alone).max() > 3


BAD_FILMS = {
    "no frames": (animate("--seconds 0"), "a video of 0 frames"),
    "another format": (animate(out="out/a.avi"), "use one of .mp4, .gif"),
    "a model": (animate(out="out/a.glb"), "not a sequence in time"),
    "a locked place": (animate(out="good.obj/film/"), "is a file"),
    "a full folder": (animate(out="out/.."), "is not empty"),
    "an odd side": (animate("--resolution 17", out="out/a.mp4"), "MP4 needs an even size"),
    "samples of a preview": (animate("--spp 4"), "--spp means nothing without --renderer path"),
    "a fade of no loop": (animate("--fade 4"), "--fade means nothing without --loop"),
    "a long fade": (animate("--loop"), "a cross-fade of 12 frames"),
    "a time of no damage": (animate("--damage-at 1"), "--damage-at means nothing without --damage"),
    "damage after the end": (animate("--damage y:0: --damage-at 1"), "choose a time within it"),
    "nothing to resume": (animate("--resume"), "start without --resume"),
    "many steps": (animate("--steps-per-frame 0"), "--steps-per-frame 0 is out of range"),
    "a field of no name": (animate("--field rihgt"), "did you mean right?"),
    "no field": (animate("--field none.npy"), "none.npy"),
    "a short field": (animate("--field short.npy"), "give numbers of shape (8, 3)"),
    "a field that is not finite": (animate("--field nan.npy"), "NaN or infinite at 8 of 8 vertices"),
    "a field of zeros": (animate("--field zero.npy"), "zero everywhere"),
    "a field across": (animate("--field normal.npy"), "normal to the surface of 'good' everywhere"),
    "a speed of nothing": (animate("--speed 2"), "'waffle' stands still, so that a speed means nothing"),
    "a great speed": (animate("--field up --speed 11"), "--speed 11 is out of range"),
    "a graft of no weights": (animate("--graft lava"), "--graft means nothing without --weights"),
    "weights of no graft": (animate("--weights y"), "--weights means nothing without --graft"),
    "a graft of another method": (animate("--graft spikes --weights y"), "'spikes' is a geometric texture"),
    "a graft of no model": (animate("--graft none --weights y"), "no model 'none'"),
    "bad weights": (animate("--graft lava --weights w"), "says nothing about weights"),
    "no mesh": (animate(mesh="none.obj"), "none.obj"),
    "no model": (animate(model="none"), "no model 'none'"),
    "a length that is no number": (animate("--seconds nan"), "--seconds nan is out of range"),
    "a great length": (animate("--seconds 3601"), "--seconds 3601 is out of range"),
    "a negative length": (animate("--seconds -1"), "--seconds -1 is out of range"),
    "no frames a second": (animate("--fps 0"), "--fps 0 is out of range"),
    "many frames a second": (animate("--fps 61"), "--fps 61 is out of range"),
    "a start before the seed": (animate("--start -1"), "--start -1 is out of range"),
    "a late start": (animate("--start 10001"), "--start 10001 is out of range"),
    "a small side": (animate("--resolution 15"), "--resolution 15 is out of range"),
    "a great side": (animate("--resolution 4097"), "--resolution 4097 is out of range"),
    "no samples": (animate("--renderer path --spp 0"), "--spp 0 is out of range"),
    "many samples": (animate("--renderer path --spp 65537"), "--spp 65537 is out of range"),
    "a great azimuth": (animate("--azimuth 361"), "--azimuth 361 is out of range"),
    "a view from the pole": (animate("--elevation 86"), "--elevation 86 is out of range"),
    "a view from far below": (animate("--elevation -86"), "--elevation -86 is out of range"),
    "a view below the floor": (animate("--renderer path --elevation -1"), "--elevation -1 is out of range"),
    "damage before the film": (animate("--damage y:0: --damage-at -1"), "--damage-at -1 is out of range"),
    "damage too late": (animate("--damage y:0: --damage-at 3601"), "--damage-at 3601 is out of range"),
    "damage never": (animate("--damage y:0: --damage-at nan"), "--damage-at nan is out of range"),
}


@pytest.mark.parametrize("name", BAD_FILMS)
def test_bad_films(files, name, capsys):
    bad.fields(files, Mesh.load(files / "good.obj").normals)
    words, message = BAD_FILMS[name]
    check_refused(files, words, message, capsys)


def test_a_graft_is_written(files, capsys):
    """Its colours at the bottom are the first model's, at the top the second's."""
    few = "--steps 20 --subdivide 2"
    albedo = {}
    for weights in ("y", "0", "1"):
        assert main(graft(f"--weights {weights} {few}")) == 0
        albedo[weights] = Asset.load(files / "out" / "a.ply").vertex_maps["albedo"]
    mesh = Asset.load(files / "out" / "a.ply").mesh
    low = mesh.vertices[:, 1] == mesh.vertices[:, 1].min()
    assert np.abs(albedo["y"] - albedo["0"])[low].max() < 0.35
    assert np.abs(albedo["0"] - albedo["1"]).max() > 0.05
    assert main(["models"]) == 0
    assert "which can be grafted with each other: bricks, ceramic, " in capsys.readouterr().out


def test_options_reach_the_graft(files, monkeypatch):
    calls = []
    apply = Graft.apply

    def small(texture, mesh, **options):
        calls.append(options)
        return apply(texture, mesh, steps=1, subdivide=0, resolution=None)

    monkeypatch.setattr(Graft, "apply", small)
    words = "--weights y --seed 4 --steps 7 --subdivide 1 --orientation 6 --scale 2 --field up --speed 3"
    assert main(graft(f"{words} --resolution 128", "out/a.glb")) == main(graft(out="out/b.glb")) == 0
    assert main(graft("--weights y --vertex-colours", "out/c.glb")) == main(graft()) == 0
    given, plain, coloured, ply = calls
    assert given == {
        **{"seed": 4, "steps": 7, "subdivide": 1, "orientation": 6, "scale": 2, "field": "up", "speed": 3},
        **{"resolution": 128},
    }
    assert plain == {
        **{"seed": 0, "steps": None, "subdivide": "auto", "orientation": 0, "scale": 1, "field": None},
        **{"speed": 1, "resolution": 1024},
    }
    assert coloured == ply == {**plain, "resolution": None}


BAD_GRAFTS = {
    "another method": (graft(models="waffle spikes"), "'spikes' is a geometric texture; graft nca textures"),
    "no second model": (graft(models="waffle"), "RUN|MODEL is missing"),
    "no weights": (graft(""), "--weights is missing"),
    "bad weights": (graft("--weights w"), "says nothing about weights"),
    "short weights": (graft("--weights short.npy"), "one number for each of 8 vertices"),
    "no UVs": (graft("--weights paint.png"), "has no UVs"),
    "a film": (graft(out="out/a.mp4"), "use one of .glb"),
    "colours in a folder": (graft("--weights y --vertex-colours", out="out/maps/"), "--vertex-colours means"),
    "its own weights": (graft("--weights short.ply", out="short.ply"), "is an input"),
    "a field of no name": (graft("--weights y --field rihgt"), "did you mean right?"),
    "a short field": (graft("--weights y --field short.npy"), "the vector field 'short.npy' is"),
    "its own field": (graft("--weights y --field short.ply", out="short.ply"), "is an input"),
    "a speed of nothing": (graft("--weights y --speed 2"), "stands still, so that a speed means nothing"),
    "a great speed": (graft("--weights y --field up --speed 11"), "--speed 11 is out of range"),
    "steps": (graft("--weights y --steps 0"), "--steps 0 is out of range"),
    "resolution of a PLY": (graft("--weights y --resolution 64"), "--resolution means nothing for .ply"),
}


@pytest.mark.parametrize("name", BAD_GRAFTS)
def test_bad_grafts(files, name, capsys):
    np.save(files / "short.npy", np.zeros(3))
    iio.imwrite(files / "paint.png", np.zeros((16, 16, 3), np.uint8))
    (files / "short.ply").write_text("ply\n")
    words, message = BAD_GRAFTS[name]
    check_refused(files, words, message, capsys)


def test_models_of_other_families_are_not_grafted(files, capsys):
    from mitex.methods.nca import NcaTexture

    texture = NcaTexture.load("lava")
    NcaTexture(texture.look, {**texture.about, "family": "another"}).save(files / "lava.safetensors")
    message = "'waffle' and 'lava' are not of one family"
    check_refused(files, graft(models="waffle lava.safetensors"), message, capsys)
