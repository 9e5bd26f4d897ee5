"""The robustness table: every bad input ends with code 2 and one `error:` line, and leaves nothing behind."""

import os
from pathlib import Path

import numpy as np
import pytest

from mitex.cli import main
from mitex.mesh import Mesh
from tests.cli import bad_files as bad
from tests.cli.refusals import QUICK, apply, check_refused, fit

# Name -> (what makes the files, the exemplar to fit, words of the message)
EXEMPLARS = {
    "missing": (lambda d: None, "no.png", "there is no exemplar"),
    "misspelt name": (lambda d: None, "cobblestown", "did you mean cobblestone"),
    "empty file": (lambda d: bad.text(d / "a.png", ""), "a.png", "is empty"),
    "text": (lambda d: bad.text(d / "a.png"), "a.png", "is not an image"),
    "gif": (lambda d: bad.image(d / "a.png", kind="GIF"), "a.png", "GIF"),
    "tiff": (lambda d: bad.image(d / "a.png", kind="TIFF"), "a.png", "TIFF"),
    "webp": (lambda d: bad.image(d / "a.png", kind="WEBP"), "a.png", "WebP"),
    "bmp": (lambda d: bad.image(d / "a.jpg", kind="BMP"), "a.jpg", "BMP"),
    "mesh": (lambda d: bad.foreign_glb(d / "a.glb"), "a.glb", "GLB"),
    "cut png": (lambda d: bad.cut(bad.image(d / "a.png")), "a.png", "damaged or cut short"),
    "cut jpeg": (
        lambda d: bad.cut(bad.image(d / "a.jpg", (99, 99), "JPEG")),
        "a.jpg",
        "damaged or cut short",
    ),
    "cut header": (lambda d: bad.cut(bad.image(d / "a.png"), 0.01), "a.png", "damaged header"),
    "50,000 x 50,000": (lambda d: bad.huge_png(d / "a.png"), "a.png", "over the limit"),
    "12,000 x 12,000": (lambda d: bad.huge_png(d / "a.png", 12_000), "a.png", "over the limit"),
    "no pixels": (lambda d: bad.huge_png(d / "a.png", 0), "a.png", "a.png"),
    "animated": (lambda d: bad.animated(d / "a.png"), "a.png", "animated"),
    "transparent": (lambda d: bad.transparent(d / "a.png"), "a.png", "transparent"),
    "tiny": (lambda d: bad.image(d / "a.png", (400, 3)), "a.png", "at least 16"),
    "device": (lambda d: None, "/dev/zero", "not a regular file"),
    "empty folder": (lambda d: (d / "maps").mkdir(), "maps", "is empty"),
    "folder without maps": (lambda d: bad.text(d / "maps" / "readme.txt"), "maps", "no map that Mitex knows"),
    "one map twice": (
        lambda d: [bad.image(d / "maps" / name) for name in ("albedo.png", "basecolor.jpg")],
        "maps",
        "albedo twice",
    ),
    "aspect ratios": (
        lambda d: [bad.image(d / "maps" / "albedo.png"), bad.image(d / "maps" / "height.png", (64, 32))],
        "maps",
        "aspect ratio",
    ),
    "a damaged map": (
        lambda d: [bad.image(d / "maps" / "albedo.png"), bad.text(d / "maps" / "ao.png")],
        "maps",
        "ao.png",
    ),
    "tiff maps only": (lambda d: bad.image(d / "maps" / "albedo.tif", kind="TIFF"), "maps", "convert"),
}

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

# Name -> (what makes the mesh, its name, words of the message)
MESHES = {
    "missing": (lambda d: None, "no.obj", "no.obj; give a mesh file, or one of"),
    "misspelt name": (lambda d: None, "octopuss", "did you mean octopus?"),
    "text": (lambda d: bad.text(d / "a.obj"), "a.obj", "a.obj"),
    "empty": (lambda d: bad.text(d / "a.obj", ""), "a.obj", "a.obj"),
    "folder": (lambda d: (d / "a.obj").mkdir(), "a.obj", "a.obj"),
    "image": (lambda d: bad.image(d / "a.ply"), "a.ply", "a.ply"),
    "unknown suffix": (lambda d: bad.text(d / "a.fbx", bad.CUBE), "a.fbx", "a.fbx"),
    "no faces": (lambda d: bad.text(d / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "a.obj", "a.obj"),
    "index out of range": (lambda d: bad.ply(d / "a.ply", face="3 0 1 7"), "a.ply", "a.ply"),
    "negative index": (lambda d: bad.ply(d / "a.ply", face="3 0 1 -2"), "a.ply", "a.ply"),
    "obj index out of range": (lambda d: bad.text(d / "a.obj", bad.CUBE + "f 1 2 99\n"), "a.obj", "a.obj"),
    "nan": (lambda d: bad.ply(d / "a.ply", vertices="0 0 0\nnan 0 0\n0 1 0"), "a.ply", "a.ply"),
    "infinite": (lambda d: bad.text(d / "a.obj", bad.CUBE.replace("v 1 1 1", "v inf 1 1")), "a.obj", "a.obj"),
    "all faces degenerate": (lambda d: bad.ply(d / "a.ply", face="3 0 0 1"), "a.ply", "a.ply"),
    "all in one point": (lambda d: bad.ply(d / "a.ply", vertices="1 1 1\n" * 2 + "1 1 1"), "a.ply", "a.ply"),
    "cut ply": (lambda d: bad.cut(bad.ply(d / "a.ply"), 0.9), "a.ply", "a.ply"),
    "cut glb": (lambda d: bad.cut(bad.foreign_glb(d / "a.glb")), "a.glb", "a.glb"),
    "cut stl": (
        lambda d: (d / "a.stl").write_bytes(b"\0" * 80 + b"\xff\0\0\0" + b"\0" * 70),
        "a.stl",
        "a.stl",
    ),
    "glb without meshes": (lambda d: bad.glb_without_meshes(d / "a.glb"), "a.glb", "a.glb"),
    "gltf that is no JSON": (lambda d: bad.text(d / "a.gltf", "{"), "a.gltf", "a.gltf"),
    "required extensions that are no list": (
        lambda d: bad.text(d / "a.gltf", '{"asset": {"version": "2.0"}, "extensionsRequired": 3}'),
        "a.gltf",
        "not valid glTF",
    ),
    "huge index": (lambda d: bad.text(d / "a.obj", bad.CUBE + f"f 1 2 {'9' * 30}\n"), "a.obj", "a.obj"),
    "endless name": (lambda d: None, "x" * 300 + ".obj", "there is no mesh"),
    "of no user": (lambda d: None, "~nosuchuser/a.obj", "there is no mesh"),
    "empty off": (lambda d: bad.text(d / "a.off", "OFF\n0 0 0\n"), "a.off", "a.off"),
}

# Commands that read a mesh
READERS = {
    "apply nca": "apply pebbles --mesh {} --out out/a.glb",
    "apply geometric": "apply spikes --mesh {} --out out/a.glb",
    "animate": "animate spikes --mesh {} --out out/a.gif",
    "graft": "graft pebbles lava --mesh {} --weights y --out out/a.glb",
    "fit surface": "fit surface --exemplar good.png --mesh {} --out out/run",
    "fit relief": "fit relief --exemplar cobblestone --mesh {} --out out/run",
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


@pytest.mark.parametrize("name", EXEMPLARS)
def test_exemplars(name, files, capsys):
    make, exemplar, message = EXEMPLARS[name]
    words = fit("", files, exemplar)
    make(files)
    check_refused(files, words, message, capsys)


@pytest.mark.parametrize("name", FITS)
def test_fit_options(name, files, capsys):
    make, words, message = FITS[name]
    words = fit(words, files)
    if make:
        make(files)
    check_refused(files, words, message, capsys)


@pytest.mark.parametrize("command", READERS)
@pytest.mark.parametrize("name", MESHES)
def test_meshes(name, command, files, capsys):
    make, mesh, message = MESHES[name]
    bad.image(files / "good.png")
    make(files)
    check_refused(files, READERS[command].format(mesh).split(), message, capsys)


@pytest.mark.parametrize("name", APPLIES)
def test_apply_options(name, more_files, capsys):
    words, message = APPLIES[name]
    check_refused(more_files, words.split() if isinstance(words, str) else words, message, capsys)


@pytest.mark.parametrize("name", RENDERS)
def test_render_options(name, more_files, capsys):
    words, message = RENDERS[name]
    check_refused(more_files, ["render", *words.split()], message, capsys)


class TestOutputsBeforeTheWork:
    """Places that cannot be written to are refused before any input is read or prepared."""

    @pytest.fixture(autouse=True)
    def no_work(self, files, monkeypatch):
        """Reading an input would end the test; a folder is there that cannot be written to."""
        for name in ("mitex.exemplar.read_image", "mitex.mesh.load.read", "mitex.export.glb.read_glb"):
            monkeypatch.setattr(name, pytest.fail)
        (files / "locked").mkdir(mode=0o500)
        real = os.access
        locked = files / "locked"  # the superuser may write everywhere
        monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != locked and real(path, mode))

    @pytest.mark.parametrize(
        ("words", "message"),
        [
            ("fit nca --exemplar good.png --out locked/run", "'{}/locked' is not writable"),
            ("fit nca --exemplar good.png --out good.png/run", "is a file"),
            ("fit surface --exemplar good.png --mesh good.obj --out locked", "'{}/locked' is not writable"),
            ("fit surface --exemplar good.png --tile 64 --out locked/run", "is not writable"),
            ("fit geometric --reference good.obj --out locked/run", "is not writable"),
            ("fit displacement --reference good.obj --out locked/run", "is not writable"),
            ("fit nerf --capture nothing --out locked/run", "is not writable"),
            ("fit plain_field --capture nothing --out locked/run", "is not writable"),
            ("fit quilted --texture nothing --out locked/run", "is not writable"),
            ("fit nerf --capture nothing --set stesp=3", "did you mean steps?"),
            ("fit plain_field --capture nothing --set stesp=3", "did you mean steps?"),
            ("apply pebbles --mesh good.obj --out locked/a.glb", "is not writable"),
            ("apply pebbles --mesh good.obj --out locked/maps/", "is not writable"),
            ("apply pebbles --tile 64 --out locked/tile", "is not writable"),
            ("apply spikes --mesh good.obj --out out/a.gltf", "use one of .glb"),
            ("animate spikes --mesh good.obj --out locked/a.mp4", "is not writable"),
            ("animate pebbles --mesh good.obj --out locked/a.gif", "is not writable"),
            ("animate pebbles --mesh good.obj --out locked/frames/", "is not writable"),
            ("graft pebbles lava --mesh good.obj --weights y --out locked/a.glb", "is not writable"),
            ("animate spikes --mesh good.obj --out out/a.png", "use one of .mp4, .gif"),
            ("animate spikes --mesh good.obj --out out/a.mp4 --resolution 33", "MP4 needs an even size"),
            ("animate spikes --mesh good.obj --out out/a.gif --meshes good.png", "is a file"),
            ("animate spikes --mesh good.obj --out out/a.gif --meshes locked/m", "is not writable"),
            ("render a.glb --out locked/a.png", "is not writable"),
            ("render a.glb --out a.glb", "'a.glb'"),
            ("render a.glb --out out/a.mp4 --resolution 33", "MP4 needs an even size"),
            ("demo --out locked/demo", "is not writable"),
            ("demo --out good.png", "is a file"),
        ],
    )
    def test_it_is_refused(self, files, words, message, capsys):
        bad.image(files / "good.png")
        bad.text(files / "a.glb")
        check_refused(files, words.split(), message.format(files), capsys)

    def test_a_folder_in_the_way_of_the_demo(self, files, capsys):
        (files / "out" / "knot.glb").mkdir()
        check_refused(files, ["demo", "--out", "out"], "'out/knot.glb' is a folder", capsys)


class TestRunFolders:
    def test_other_files(self, files, capsys):
        bad.text(files / "out" / "run" / "thesis.txt")
        check_refused(files, fit(QUICK, files), "other files", capsys)

    def test_a_run_is_there_already(self, files, capsys):
        bad.safetensors(files / "out" / "run" / "checkpoint.safetensors")
        check_refused(files, fit(QUICK, files), "--resume", capsys)

    def test_resume_of_a_damaged_checkpoint(self, files, capsys):
        bad.text(files / "out" / "run" / "metrics.jsonl", '{"step": 1}\n')
        bad.text(files / "out" / "run" / "checkpoint.safetensors")
        check_refused(files, fit(f"--resume {QUICK}", files), "checkpoint", capsys)

    def test_resume_of_a_foreign_checkpoint(self, files, capsys):
        bad.text(files / "out" / "run" / "metrics.jsonl", '{"step": 1}\n')
        bad.safetensors(files / "out" / "run" / "checkpoint.safetensors")
        check_refused(files, fit(f"--resume {QUICK}", files), "checkpoint", capsys)

    def test_below_a_file(self, files, capsys):
        check_refused(files, fit(QUICK, files, out="good.obj/run"), "is a file", capsys)

    def test_is_a_file(self, files, capsys):
        check_refused(files, fit(QUICK, files, out="good.obj"), "good.obj", capsys)


class TestArchitectures:
    """Weights of another shape are refused where they do not fit."""

    def test_init(self, files, capsys):
        bad.model(files / "small.safetensors", hidden=16)
        check_refused(files, fit(f"--init small.safetensors {QUICK}", files), "hidden", capsys)

    def test_resume(self, files, capsys):
        assert main(fit(QUICK, files)) == 0
        capsys.readouterr()
        check_refused(files, fit("--resume --set hidden=16", files), "hidden", capsys)
        bad.image(files / "other" / "good.png", seed=1)
        words = fit("--resume", files, "other/good.png")
        check_refused(files, words, "the exemplar 'good' is not the one that the run began with", capsys)

    def test_tensors_that_do_not_fit_together(self, files, capsys):
        bad.model(files / "odd.safetensors", hidden=16, cut=1)
        check_refused(files, apply(model="odd.safetensors"), "odd.safetensors", capsys)

    def test_weights_that_are_not_finite(self, files, capsys):
        bad.model(files / "nan.safetensors", fill=float("nan"))
        check_refused(files, apply(model="nan.safetensors"), "not finite", capsys)

    def test_a_condition_that_no_option_gives(self, files, capsys):
        bad.model(files / "graft.safetensors", condition=4)
        check_refused(files, apply(model="graft.safetensors"), "'graft' needs a condition of 4", capsys)

    @pytest.mark.parametrize(
        ("words", "message"),
        [
            ("", "'wind' needs a condition of 3 values at each vertex, and has none here; give --field"),
            ("--field rihgt", "did you mean right?"),
            ("--field none.npy", "none.npy"),
            ("--field short.npy", "shape (8, 3)"),
            ("--field nan.npy", "NaN or infinite at 8 of 8 vertices"),
            ("--field zero.npy", "zero everywhere"),
            ("--field normal.npy", "normal to the surface of 'good' everywhere"),
        ],
    )
    def test_fields_of_a_moving_texture(self, files, capsys, words, message):
        bad.model(files / "wind.safetensors", condition=3)
        bad.fields(files, Mesh.load(files / "good.obj").normals)
        check_refused(files, apply(words, model="wind.safetensors"), message, capsys)

    def test_a_field_is_not_overwritten(self, files, capsys):
        bad.model(files / "wind.safetensors", condition=3)
        bad.ply(files / "wind.ply")
        words = apply("--field wind.ply", model="wind.safetensors", out="wind.ply")
        check_refused(files, words, "wind.ply", capsys)
