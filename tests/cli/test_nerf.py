"""`mitex fit nerf`, and `mitex apply` of what it makes."""

import json
from pathlib import Path
from shutil import copy, copytree

import numpy as np
import pytest
from PIL import Image

from mitex.cli import main
from mitex.images import read_image
from mitex.mesh import Mesh, icosphere, quality
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.texture import SIZE
from tests.cli import bad_files as bad
from tests.cli.refusals import check_refused
from tests.methods.fits import few_patches, small_coarse_fields
from tests.methods.nerf.capture.ellipsoid import CENTRE, RADII, rgba, set_alpha, write

pytestmark = pytest.mark.usefixtures("own_cache")
SMALL = "base_steps=150 rays=512 ray_steps=96 table=11 coarsest=8 finest=32 occupancy=32"
QUICK = f"--quiet --set steps=4 checkpoint_every=2 preview_every=0 {SMALL}"


def fit(words=QUICK, base="base.obj", out="out/run"):
    return f"fit nerf --capture photos --base-mesh {base} --out {out} {words}".split()


def apply(words="--size 128", mesh="ball.obj", out="out/a.ply"):
    return f"apply out/run --mesh {mesh} --out {out} {words}".split()


def holed(frequency=8):
    """A little smaller than the object, and open on top."""
    ball = icosphere(frequency)
    low = ball.vertices[ball.faces].mean(1)[:, 2] < 0.6
    return Mesh(CENTRE + 0.9 * RADII * ball.vertices, ball.faces[low], name="holed")


def save(mesh, path):
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
    bad.text(path, "\n".join(lines) + "\n")


@pytest.fixture(scope="module", autouse=True)
def _small_coarse_fields():
    """For all fits, or the base shape of one would not be that of another."""
    with pytest.MonkeyPatch.context() as patch:
        small_coarse_fields(patch)
        yield


@pytest.fixture(scope="module")
def source(tmp_path_factory, own_cache):
    folder = tmp_path_factory.mktemp("trained")
    save(holed(54), folder / "base.obj")  # even enough not to be remeshed
    write(folder / "photos", 16)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(fit(out="run")) == 0
    return folder / "run"


@pytest.fixture
def photos(files):
    save(holed(), files / "base.obj")
    return write(files / "photos", 16)


@pytest.fixture
def run(files, source):
    save(icosphere(6), files / "ball.obj")
    return Path(copytree(source, files / "out" / "run"))


def test_a_base_mesh_with_holes_is_fitted(source):
    assert (source / "metrics.jsonl").is_file()
    assert quality(NerfTexture.load(source).model.base.mesh).boundary_edges > 0


def test_views_given_twice_are_left_out(files, photos, source, capsys):
    """So the base shape is that of the fixture's run, from the cache."""
    copy(source.parent / "base.obj", files)
    path = photos / "transforms.json"
    tree = json.loads(path.read_text())
    tree["frames"].append(tree["frames"][3])
    path.write_text(json.dumps(tree))
    assert main(fit()) == 0
    assert "is the view" in capsys.readouterr().err


def shorten(folder):
    bad.cut(folder / "images" / "004.png")


def resize(folder):
    image = folder / "images" / "004.png"
    Image.open(image).resize((30, 20)).save(image)


def opaque(folder):
    for image in (folder / "images").iterdir():
        Image.open(image).convert("RGB").save(image)


def empty_masks(folder):
    for image in (folder / "images").iterdir():
        Image.fromarray(rgba(np.zeros((48, 48), bool))).save(image)


def with_pose(value):
    def change(folder):
        path = folder / "transforms.json"
        tree = json.loads(path.read_text())
        tree["frames"][4]["transform_matrix"][0][3] = value
        path.write_text(json.dumps(tree))

    return change


def inside(folder):
    path = folder / "transforms.json"
    tree = json.loads(path.read_text())
    for row in range(3):
        tree["frames"][4]["transform_matrix"][row][3] = CENTRE[row]
    path.write_text(json.dumps(tree))
    set_alpha(folder, [4], 255)


CAPTURES = {
    "missing image": (lambda d: (d / "images" / "004.png").unlink(), "which does not exist"),
    "truncated image": (shorten, "damaged or cut short"),
    "wrong size": (resize, "004.png"),
    "no alpha": (opaque, "mask"),
    "empty masks": (empty_masks, "all masks are empty"),
    "one empty mask": (lambda d: set_alpha(d, [4], 0), "is empty"),
    "NaN": (with_pose(float("nan")), "pose"),
    "camera inside": (inside, "inside the object"),
    "no photos": (lambda d: [p.unlink() for p in d.rglob("*") if p.is_file()], "photos"),
}


@pytest.mark.parametrize("name", CAPTURES)
def test_bad_captures(files, photos, capsys, name):
    breaking, message = CAPTURES[name]
    breaking(photos)
    check_refused(files, fit(), message, capsys)


FITS = {
    "missing base": ("base", "no.obj", "no.obj"),
    "base elsewhere": ("base", "good.obj", "reaches out of the scene cube"),
    "setting": ("words", "--set neighbours=0", "neighbours"),
}


@pytest.mark.parametrize("name", FITS)
def test_bad_fits(files, photos, capsys, name):
    key, value, message = FITS[name]
    check_refused(files, fit(**{key: value}), message, capsys)


@pytest.fixture
def asked(monkeypatch) -> list[dict]:
    """The options that textures were applied with."""
    calls, texture_apply = [], NerfTexture.apply

    def recorded(self, mesh, **options):
        calls.append(dict(options))
        return texture_apply(self, mesh, **options)

    monkeypatch.setattr(NerfTexture, "apply", recorded)
    return calls


def test_a_guide_a_lift_and_a_light(files, run, monkeypatch, asked):
    few_patches(monkeypatch)
    bad.image(files / "guide.png")
    words = "--scale 16 --guide guide.png --lift 0.5 --density 1000 --seed 2"
    assert main(apply(words)) == 0
    assert len(Mesh.load(files / "out" / "a.ply").faces) > 100
    np.testing.assert_array_equal(asked[0].pop("guide"), read_image(files / "guide.png"))
    numbers = {"scale": 16, "lift": 0.5, "density": 1000, "seed": 2}
    assert asked[0] == {"size": SIZE, "quilting": None, **numbers}
    assert main(apply(f"{words} --resolution 64", out="out/a.png")) == 0
    own = read_image(files / "out" / "a.png")
    assert own.shape == (64, 64, 3)
    assert main(apply(f"{words} --resolution 64 --light scene", out="out/lit.png")) == 0
    assert np.abs(read_image(files / "out" / "lit.png") - own).max() > 0.1


@pytest.mark.parametrize("quilting", [None, "surface", "plane"])
def test_where_patches_are_joined(files, run, monkeypatch, asked, quilting):
    few_patches(monkeypatch)
    words = f"--quilting {quilting}" if quilting else ""
    assert main(apply(f"--size 128 --scale 16 --density 1000 {words}")) == 0
    assert asked[0]["quilting"] == quilting and asked[0]["size"] == 128
    assert len(Mesh.load(files / "out" / "a.ply").faces) > 100


APPLIED = {
    "quilting": ("--quilting sphere", "--quilting"),
    "quilting and guide": ("--quilting surface --guide no.png", "no.png"),
    "too fine for the surface": ("--size 128 --scale 0.05 --quilting surface", "use larger scales"),
    "lift": ("--lift 2", "--lift"),
    "size": ("--size 10", "--size"),
    "size and guide": ("--size 128 --guide no.png", "--size and --guide in the plane"),
    "scale and guide": ("--scale 0.05 --guide guide.png", "use larger scales"),
    "density": ("--density 0", "--density"),
    "guide": ("--guide no.png", "no.png"),
    "resolution": ("--resolution 64", "--resolution means nothing for .ply"),
    "light": ("--light scene", "--light means nothing for .ply"),
    "steps": ("--steps 10", "--steps is no option"),
}


@pytest.mark.parametrize("name", APPLIED)
def test_bad_uses(files, run, capsys, name):
    words, message = APPLIED[name]
    bad.image(files / "guide.png")
    check_refused(files, apply(words), message, capsys)


def test_lifts_are_for_radiance_fields(files, capsys):
    words = ["apply", "pebbles", "--mesh", "good.obj", "--out", "out/a.glb", "--lift", "0"]
    check_refused(files, words, "--lift is no option", capsys)
