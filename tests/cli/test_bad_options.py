"""Bad options, models and places of `fit`, `apply` and `render`: each is refused with one `error:` line."""

import os

import numpy as np
import pytest

from tests.cli import bad_files as bad
from tests.cli.refusals import QUICK, apply, check_refused, fit

# Name -> (what makes the files, words after `fit nca`, words of the message)
FITS = {
    "steps 0": (None, "--steps 0", "--steps 0"),
    "negative steps": (None, "--steps -5", "--steps -5"),
    "steps in words": (None, "--steps many", "--steps cannot be 'many'"),
    "negative seed": (None, "--seed -1", "--seed -1"),
    "huge seed": (None, "--seed 99999999999", "--seed"),
    "unknown option": (None, "--epochs 5", "--epochs"),
    "unknown key": (None, "--set hiden=64", "did you mean hidden?"),
    "no equals sign": (None, "--set hidden", "key=value"),
    "value of the wrong type": (None, "--set hidden=big", "hidden"),
    "value that is not finite": (None, "--set lr=nan", "lr"),
    "value out of range": (None, "--set hidden=-3", "hidden"),
    "a key twice": (None, "--steps 5 --set steps=6", "steps is set to 6 and to 5"),
    "unknown preset": (None, "--preset papper", "did you mean paper?"),
    "unknown layer": (None, "--set layers=relu9_9", "relu9_9"),
    "missing config": (None, "--config no.toml", "no.toml"),
    "config that is no TOML": (lambda d: bad.text(d / "c.toml", "steps = = 3"), "--config c.toml", "TOML"),
    "binary config": (lambda d: (d / "c.toml").write_bytes(b"\xff\xfe\0"), "--config c.toml", "c.toml"),
    "config is a folder": (lambda d: (d / "c.toml").mkdir(), "--config c.toml", "c.toml"),
    "endless config": (None, "--config /dev/zero", "no regular file"),
    "config of no user": (None, "--config ~nosuchuser/c.toml", "cannot be read"),
    "config of an endless name": (None, f"--config {'c' * 300}", "cannot be read"),
    "unknown key in the config": (
        lambda d: bad.text(d / "c.toml", "stepps = 3"),
        "--config c.toml",
        "did you mean steps?",
    ),
    "wrong type in the config": (lambda d: bad.text(d / "c.toml", "steps = [3]"), "--config c.toml", "steps"),
    "presets that contradict": (
        lambda d: bad.text(d / "c.toml", 'preset = "paper"'),
        "--config c.toml --preset patch",
        "contradict",
    ),
    "presets of --preset and --set": (None, "--preset patch --set preset=paper", "contradicts"),
    "resume and init": (None, "--resume --init cobblestone", "--resume and --init contradict"),
    "resume without a run": (None, "--resume", "no checkpoint"),
    "unknown device": (None, "--device tpu", "--device"),
    "unknown field": (None, "--motion rihgt", "did you mean right?"),
    "a field twice": (None, "--motion up --set motion=down", "motion is set to down and to up"),
    "field of one mesh": (None, "--motion wind.npy", "is the field of one mesh"),
    "unknown init": (None, f"--init no_such_model {QUICK}", "no_such_model"),
    "damaged init": (
        lambda d: bad.text(d / "m.safetensors"),
        f"--init m.safetensors {QUICK}",
        "m.safetensors",
    ),
    "foreign init": (
        lambda d: bad.safetensors(d / "m.safetensors"),
        f"--init m.safetensors {QUICK}",
        "m.safetensors",
    ),
}

# Name -> (words of the command, words of the message)
APPLIES = {
    "no options": ("apply", "RUN|MODEL is missing"),
    "unknown model": (apply(model="peblles"), "peblles"),
    "missing run": (apply(model="runs/none"), "runs/none"),
    "empty run": (apply(model="empty"), "empty"),
    "damaged model": (apply(model="damaged.safetensors"), "damaged.safetensors"),
    "foreign model": (apply(model="foreign.safetensors"), "foreign.safetensors"),
    "pickled model": (apply(model="model.pt"), "model.pt"),
    "damaged run": (apply(model="damaged_run"), "damaged_run"),
    "model is an image": (apply(model="image.png"), "image.png"),
    "wrong suffix": (apply(out="out/a.fbx"), "use one of .glb, .obj, .ply, .exr"),
    "no suffix": (apply(out="out/a"), "no suffix"),
    "below a file": (apply(out="good.obj/a.glb"), "is a file"),
    "a folder": (apply(out="folder.glb"), "is a folder"),
    "a pipe": (apply(out="pipe.glb"), "pipe or a device"),
    "a field with a damaged header": (apply("--orientation field.npy"), "field.npy"),
    "a field of no user": (apply("--orientation ~nosuchuser/a.npy"), "no file of vectors"),
    "a capture of no user": ("fit nerf --capture ~nosuchuser/a --out out/a", "not a folder"),
    "a capture of an endless name": (f"fit nerf --capture {'x' * 300} --out out/a", "not a folder"),
    "endless name": (apply(out="out/" + "x" * 300 + ".glb"), "too long"),
    "scale 0": (apply("--scale 0"), "--scale 0"),
    "negative scale": (apply("--scale -1"), "--scale -1"),
    "scale nan": (apply("--scale nan"), "--scale nan"),
    "infinite orientation": (apply("--orientation inf"), "--orientation inf"),
    "negative resolution": (apply("--resolution -512"), "--resolution -512"),
    "huge resolution": (apply("--resolution 100000"), "--resolution 100000"),
    "subdivide in words": (apply("--subdivide much"), "'much'"),
    "negative subdivide": (apply("--subdivide -1"), "'-1'"),
    "steps 0": (apply("--steps 0"), "--steps 0"),
    "seed too large": (apply("--seed 4294967296"), "--seed"),
    "vertex colours and resolution": (apply("--vertex-colours --resolution 64"), "contradict"),
    "vertex colours in obj": (apply("--vertex-colours", out="out/a.obj"), "means nothing for .obj"),
    "resolution of ply": (apply("--resolution 64", out="out/a.ply"), "means nothing for .ply"),
    "negative speed": (apply("--speed -1"), "--speed -1"),
    "relief too deep": (apply("--relief 0.7"), "--relief 0.7"),
    "relief of colours at vertices": (
        apply("--relief 0.1 --vertex-colours"),
        "--relief and --vertex-colours",
    ),
    "relief of variants": (apply("--relief 0.1 --variants 2"), "--relief and --variants"),
    "relief of a page": (apply("--relief 0.1", out="out/a.html"), "--relief means nothing for .html"),
    "speed of a still texture": (apply("--speed 2"), "'pebbles' stands still, so that a speed means nothing"),
    "field of no name": (apply("--field rihgt"), "did you mean right?"),
    "field of a tile": ("apply pebbles --tile 64 --field about-x --out out/tile", "normal to the surface"),
    "field of a page": (apply("--field rihgt", out="out/a.html"), "did you mean right?"),
}

RENDERS = {
    "missing": ("no.glb --out out/a.png", "no.glb"),
    "foreign glb": ("foreign.glb --out out/a.png", "foreign.glb"),
    "text": ("text.glb --out out/a.png", "text.glb"),
    "plain ply": ("plain.ply --out out/a.png", "plain.ply"),
    "plain obj": ("good.obj --out out/a.png", "good.obj"),
    "image": ("image.png --out out/a.png", "image.png"),
    "wrong suffix": ("foreign.glb --out out/a.webm", ".webm"),
    "below a file": ("foreign.glb --out good.obj/a.png", "is a file"),
    "size 0": ("foreign.glb --out out/a.png --resolution 0", "--resolution 0"),
    "negative size": ("foreign.glb --out out/a.png --resolution -9", "--resolution -9"),
    "spp 0": ("foreign.glb --out out/a.png --spp 0", "--spp 0"),
    "azimuth nan": ("foreign.glb --out out/a.png --azimuth nan", "--azimuth nan"),
    "elevation beyond the pole": ("foreign.glb --out out/a.png --elevation 91", "--elevation 91"),
    "one frame": ("foreign.glb --out out/a.mp4 --frames 1", "--frames 1"),
    "below the floor": ("foreign.glb --out out/a.png --elevation -20", "--elevation -20"),
    "exposure": ("foreign.glb --out out/a.png --exposure 11", "--exposure 11"),
    "azimuth of a turntable": ("foreign.glb --out out/a.gif --azimuth 3", "means nothing for .gif"),
    "frames of a still": ("foreign.glb --out out/a.png --frames 9", "means nothing for .png"),
}


@pytest.fixture
def more_files(files):
    bad.text(files / "damaged.safetensors")
    bad.safetensors(files / "foreign.safetensors")
    bad.safetensors(files / "damaged_run" / "checkpoint.safetensors")
    bad.cut(files / "damaged_run" / "checkpoint.safetensors")
    bad.image(files / "image.png")
    bad.text(files / "text.glb")
    bad.ply(files / "plain.ply")
    bad.foreign_glb(files / "foreign.glb")
    (files / "model.pt").write_bytes(b"\x80\x04cposix\nsystem\n(S'touch out/hacked'\ntR.")
    (files / "empty").mkdir()
    (files / "folder.glb").mkdir()
    os.mkfifo(files / "pipe.glb")
    np.save(files / "field.npy", np.zeros((8, 3)))
    header = (files / "field.npy").read_bytes().replace(b"'shape': (8, 3)", b"'shape': (8, [)")
    (files / "field.npy").write_bytes(header)
    return files


@pytest.mark.parametrize("name", FITS)
def test_fit_options(name, files, capsys):
    make, words, message = FITS[name]
    words = fit(words, files)
    if make:
        make(files)
    check_refused(files, words, message, capsys)


@pytest.mark.parametrize("name", APPLIES)
def test_apply_options(name, more_files, capsys):
    words, message = APPLIES[name]
    check_refused(more_files, words.split() if isinstance(words, str) else words, message, capsys)


@pytest.mark.parametrize("name", RENDERS)
def test_render_options(name, more_files, capsys):
    words, message = RENDERS[name]
    check_refused(more_files, ["render", *words.split()], message, capsys)
