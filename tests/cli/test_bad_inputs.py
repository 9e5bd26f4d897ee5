"""The robustness table: every bad input ends with code 2 and one `error:` line, and leaves nothing behind."""

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


@pytest.mark.parametrize("name", EXEMPLARS)
def test_exemplars(name, files, capsys):
    make, exemplar, message = EXEMPLARS[name]
    words = fit("", files, exemplar)
    make(files)
    check_refused(files, words, message, capsys)


@pytest.mark.parametrize("command", READERS)
@pytest.mark.parametrize("name", MESHES)
def test_meshes(name, command, files, capsys):
    make, mesh, message = MESHES[name]
    bad.image(files / "good.png")
    make(files)
    check_refused(files, READERS[command].format(mesh).split(), message, capsys)


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
