"""`mitex fit geometric`, and `mitex apply` of what it makes."""

from dataclasses import replace
from pathlib import Path
from shutil import copytree

import imageio.v3 as iio
import numpy as np
import pytest

from mitex.cli import main
from mitex.mesh import Mesh, grid, icosphere, quality, subdivide_midpoint
from mitex.methods.geometric.placement import Bumps
from tests.cli import bad_files as bad
from tests.cli.refusals import check_refused
from tests.methods.geometric.small import rough_reports
from tests.shapes import collapsed, fan, pair, turned

pytestmark = pytest.mark.usefixtures("own_cache")
QUICK = "--quiet --set steps=4 level_steps=2 fit_steps=20 fit_samples=200 checkpoint_every=2 preview_every=0"


def fit(words=QUICK, reference="good.obj", out="out/run"):
    return f"fit geometric --reference {reference} --out {out} {words}".split()


@pytest.fixture(autouse=True, scope="module")
def _rough_reports():
    with pytest.MonkeyPatch.context() as patch:
        rough_reports(patch)
        yield


@pytest.fixture(scope="module")
def source(tmp_path_factory, own_cache):
    folder = tmp_path_factory.mktemp("trained")
    bad.text(folder / "good.obj", bad.CUBE)
    assert main(fit(reference=folder / "good.obj", out=folder / "run")) == 0
    return folder / "run"


@pytest.fixture
def run(files, source):
    return Path(copytree(source, files / "out" / "run"))


def apply(words="", mesh="good.obj"):
    return f"apply out/run --mesh {mesh} --out out/a.ply {words}".split()


def test_fit_apply_render(files, capsys):
    assert main(fit()) == 0
    assert capsys.readouterr().out.strip() == "out/run"
    assert main(apply("--start-level 0 --end-level 1 --seed 3")) == 0
    assert len(Mesh.load(files / "out" / "a.ply").faces) == 4 * 12
    assert main(["render", "out/a.ply", "--out", "out/a.png", "--resolution", "32", "--spp", "1"]) == 0


def test_further_levels_by_resuming(files, run):
    assert main(fit("--resume --quiet --steps 6")) == 0
    assert main(apply("--start-level 0 --end-level 2")) == 0
    assert len(Mesh.load(files / "out" / "a.ply").faces) == 16 * 12


def test_resuming_with_another_reference_of_the_same_name(files, run, capsys, monkeypatch):
    """It is noticed before the training meshes are computed, which takes minutes."""
    monkeypatch.setattr("mitex.methods.geometric.fitting.training_meshes", None)
    bad.text(files / "good.obj", bad.CUBE.replace("v 1 1 1", "v 1.5 1 1"))
    message = "the reference 'good' is not the one that the run began with"
    check_refused(files, fit("--resume --quiet"), message, capsys)


def test_remeshing_first(files, run):
    pytest.importorskip("pymeshlab")
    assert main(apply("--remesh 200 --start-level 1")) == 0
    assert 150 < len(Mesh.load(files / "out" / "a.ply").vertices) < 260


def test_a_variation_of_the_reference(files, run):
    assert main(apply("--seed 2", mesh="template")) == 0
    assert len(Mesh.load(files / "out" / "a.ply").faces) == 4 * 20


def test_advice_on_the_size(files, run, capsys):
    """The cube has 12 faces, the template 80 on level 1, the last one here."""
    assert main(apply()) == 0
    assert "features are 2.6 times as large as on the reference" in capsys.readouterr().err


def test_untangling_draws_back_towards_the_mesh(files, run, monkeypatch):
    """As far as the split mesh, in place of which `untangled` would have a part of the relief."""
    monkeypatch.setattr("mitex.methods.geometric.texture.untangled", lambda before, after: before)
    split = subdivide_midpoint(Mesh.load("good.obj")).vertices
    for words, bare in (("", False), (" --untangle", True)):
        assert main(apply("--start-level 0 --end-level 1" + words)) == 0
        vertices = Mesh.load(files / "out" / "a.ply").vertices
        assert (np.abs(vertices - split).max() < 1e-5) == bare


@pytest.mark.parametrize("command", ["apply", "animate"])
def test_bumps_are_placed_or_not(files, run, monkeypatch, command):
    bumps = Bumps(4.0, 3.0)
    monkeypatch.setattr("mitex.methods.geometric.texture.bumps", lambda mesh, edge: bumps)
    results = []
    for words in ("", "--placement even", "--placement none"):
        arguments = [*apply(words), "--quiet"]
        if command == "animate":
            small = "--meshes out/meshes --frames 2 --resolution 16 --spp 1 --end-level 0"
            arguments = f"animate out/run --mesh good.obj --out out/a.gif {small} {words}".split()
        assert main(arguments) == 0
        result = "out/a.ply" if command == "apply" else "out/meshes/0002.ply"
        results.append(Mesh.load(files / result).vertices)
    assert np.array_equal(results[0], results[1])
    assert np.abs(results[0] - results[2]).max() > 0.5


@pytest.fixture(scope="module")
def ribbed(tmp_path_factory, own_cache):
    """A model that has learned to follow a field."""
    folder = tmp_path_factory.mktemp("ribbed")
    bad.text(folder / "good.obj", bad.CUBE)
    assert main(fit(f"--field up {QUICK} symmetric=true", folder / "good.obj", folder / "run")) == 0
    return folder / "run"


def follow(ribbed, words="", mesh="good.obj", command="apply", out="out/a.ply"):
    return f"{command} {ribbed} --mesh {mesh} --out {out} --start-level 0 {words}".split()


def test_a_relief_follows_the_field(files, ribbed):
    """Of a name or a file, either way round; another field, another relief."""
    np.save("right.npy", np.tile([1.0, 0, 0], (8, 1)))
    results = []
    for field in ("up", "down", "right", "right.npy"):
        assert main(follow(ribbed, f"--field {field}")) == 0
        results.append(Mesh.load("out/a.ply").vertices)
    up, down, right, told = results
    assert np.allclose(up, down, atol=1e-5) and np.allclose(right, told, atol=1e-5)
    assert np.abs(up - right).max() > 1e-3


def test_the_field_of_a_file_is_carried_to_the_remeshed(files, ribbed):
    pytest.importorskip("pymeshlab")
    write(files / "ball.obj", BALL)
    np.save("right.npy", np.tile([1.0, 0, 0], (len(BALL.vertices), 1)))
    results = []
    for field in ("right", "right.npy", "up"):
        assert main(follow(ribbed, f"--remesh 60 --field {field}", "ball.obj")) == 0
        results.append(Mesh.load("out/a.ply").vertices)
    right, told, up = results
    assert np.abs(right - told).mean() < 0.2 * np.abs(right - up).mean()


def test_films_follow_the_field(files, ribbed):
    for words, seed in (("", 0), ("--to-seed 1", 1)):
        film = f"--frames 2 --resolution 32 --spp 1 --meshes out/to{seed} --field right {words}"
        assert main(follow(ribbed, film, command="animate", out="out/a.gif")) == 0
        last = sorted((files / "out" / f"to{seed}").iterdir())[-1]
        assert main(follow(ribbed, f"--field right --seed {seed}")) == 0
        assert np.allclose(Mesh.load(last).vertices, Mesh.load("out/a.ply").vertices, atol=1e-5)


def test_bad_fields(files, ribbed, run, capsys):
    np.save("nan.npy", np.full((8, 3), np.nan))
    np.save("zero.npy", np.zeros((8, 3)))
    np.save("short.npy", np.ones((7, 3)))
    np.save("normal.npy", Mesh.load("good.obj").normals)
    refusals = {
        "": "follows a vector field; give a --field, such as up",
        "--field upp": "did you mean up?",
        "--field none.npy": "none.npy",
        "--field nan.npy": "NaN",
        "--field zero.npy": "zero everywhere",
        "--field short.npy": "a vector for each vertex",
        "--field normal.npy": "normal to the surface of 'good' everywhere",
    }
    for words, message in refusals.items():
        check_refused(files, follow(ribbed, words), message, capsys)
    contradiction = "--mesh template and --field contradict each other"
    check_refused(files, follow(ribbed, "--field up", mesh="template"), contradiction, capsys)
    check_refused(files, apply("--field up"), "follows no --field; leave it out", capsys)
    over = follow(ribbed, "--field nan.npy", out="nan.npy")
    check_refused(files, over, "nan.npy", capsys)


def animate(words="", mesh="good.obj", model="out/run", out="out/a.gif"):
    return f"animate {model} --mesh {mesh} --out {out} --resolution 32 --spp 1 {words}".split()


@pytest.mark.parametrize(
    ("words", "mesh", "count"),
    [("--start-level 0 --frames 2", "good.obj", 5), ("--frames 2", "template", 5)],
)
def test_films_of_growth(files, run, words, mesh, count):
    """The bare mesh, and two frames a level."""
    assert main(animate(f"{words} --meshes out/frames", mesh)) == 0
    assert len(iio.imread("out/a.gif")) == count
    frames = sorted((files / "out" / "frames").iterdir())
    assert [p.name for p in frames] == [f"{k:04}.ply" for k in range(count)]
    faces = 12 if mesh == "good.obj" else 20
    assert [len(Mesh.load(p).faces) for p in frames] == [faces] * 3 + [4 * faces] * 2


def test_a_film_from_seed_to_seed(files, run):
    """Its first and last mesh are the seeds' own."""
    assert main(animate("--seed 3 --to-seed 4 --frames 3 --meshes out/frames")) == 0
    for name, seed in (("0000", 3), ("0002", 4)):
        assert main(apply(f"--seed {seed}")) == 0
        alone, frame = Mesh.load("out/a.ply"), Mesh.load(f"out/frames/{name}.ply")
        assert np.abs(alone.vertices - frame.vertices).max() < 1e-5


BAD_FILMS = {
    "a still": (animate(out="out/a.png"), ".mp4"),
    "one frame": (animate("--frames 1"), "--frames"),
    "no frames a second": (animate("--fps 0"), "--fps"),
    "huge pictures": (animate("--resolution 9999"), "--resolution"),
    "odd size": (animate("--resolution 33", out="out/a.mp4"), "even size"),
    "level beyond": (animate("--end-level 5"), "this texture has the levels 0 to 1"),
    "missing mesh": (animate(mesh="none.obj"), "none.obj"),
    "a remeshed template": (animate("--remesh 100", "template"), "--mesh template and --remesh contradict"),
    "meshes in a file": (animate("--meshes good.obj"), "good.obj"),
}


@pytest.mark.parametrize("name", BAD_FILMS)
def test_bad_films(files, run, name, capsys):
    words, message = BAD_FILMS[name]
    check_refused(files, words, message, capsys)


def test_a_film_of_a_texture_that_does_not_grow(files, capsys):
    bad.safetensors(files / "flat.safetensors", format="mitex-surface-1")
    message = "takes no surface textures; name a run of geometric or nca"
    check_refused(files, animate(model="flat.safetensors"), message, capsys)


def write(path, mesh):
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices] + [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    bad.text(path, "\n".join(lines))


BALL = icosphere(3)
SLIVERS = replace(BALL, faces=np.concatenate([BALL.faces, [[0, 0, 1], [2, 2, 2]]]))
UNSOUND = {
    "open": (grid(5, 4), 160),
    "non-manifold": (fan(), 12),
    "two components": (pair(BALL), 8 * len(BALL.faces)),
    "inconsistent winding": (turned(BALL), 4 * len(BALL.faces)),
    "faces without area": (SLIVERS, 4 * len(BALL.faces)),
    "a side without length": (collapsed(BALL), 4 * (len(BALL.faces) - 2)),
}


@pytest.mark.filterwarnings("ignore::mitex.errors.MeshWarning")
@pytest.mark.parametrize("name", UNSOUND)
def test_open_and_unsound_meshes_are_displaced(files, run, name):
    mesh, faces = UNSOUND[name]
    write(files / "mesh.obj", mesh)
    assert main(apply("--start-level 0", mesh="mesh.obj")) == 0
    assert len(Mesh.load(files / "out" / "a.ply").faces) == faces


@pytest.mark.filterwarnings("ignore::mitex.errors.MeshWarning")
@pytest.mark.parametrize("name", ["open", "two components", "faces without area"])
def test_references_that_are_learned(files, name):
    pytest.importorskip("pymeshlab")
    mesh, _ = UNSOUND[name]
    write(files / "mesh.obj", mesh)
    assert main(fit(reference="mesh.obj")) == 0
    assert main(apply(mesh="template")) == 0
    report = quality(Mesh.load(files / "out" / "a.ply"))
    assert (report.components, report.boundary_edges > 0) == (1 + (name == "two components"), name == "open")


BAD_FITS = {
    "no options": ("fit geometric", "--reference is missing"),
    "missing reference": (fit(reference="none.obj"), "none.obj"),
    "misspelt reference": (fit(reference="spike"), "spike"),
    "empty reference": (fit(reference="empty.obj"), "empty.obj"),
    "non-manifold reference": (fit(reference="fan.obj"), "repair it"),
    "inconsistent winding": (fit(reference="wound.obj"), "repair it"),
    "reference without area": (fit(reference="flat.obj"), "degenerate"),
    "template of another genus": (
        fit(f"--template octopus {QUICK}", reference="warts"),
        "--template of the same",
    ),
    "missing template": (fit(f"--template none.obj {QUICK}"), "none.obj"),
    "too many levels": (fit("--quiet --steps 100 --set level_steps=1"), "levels"),
    "unknown key": (fit("--quiet --set level_step=1"), "level_steps"),
    "unknown preset": (fit("--quiet --preset quick"), "quick"),
    "unknown field": (fit(f"--field upp {QUICK}"), "did you mean up?"),
    "ends without a field": (fit(f"{QUICK} symmetric=true"), "leave `symmetric` out"),
    "negative noise": (fit("--quiet --set noise=-1"), "noise"),
    "an exemplar": (fit("--exemplar good.png"), "--exemplar"),
}


@pytest.mark.parametrize("name", BAD_FITS)
def test_bad_fits(files, name, capsys):
    bad.text(files / "empty.obj", "")
    bad.text(files / "fan.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n")
    bad.text(files / "wound.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n")
    bad.text(files / "flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
    words, message = BAD_FITS[name]
    check_refused(files, words.split() if isinstance(words, str) else words, message, capsys)


BAD_APPLIES = {
    "an untangled template": ("--untangle --mesh template", "leave it out"),
    "a remeshed template": ("--remesh 100 --mesh template", "--mesh template and --remesh contradict"),
    "an unplaced template": (
        "--placement none --mesh template",
        "--mesh template and --placement none contradict",
    ),
    "level beyond": ("--end-level 5", "this texture has the levels 0 to 1"),
    "level below": ("--start-level -1", "--start-level"),
    "levels in reverse": ("--start-level 1 --end-level 0", "out of range"),
    "orientation": ("--orientation 30", "--orientation is no option"),
    "steps": ("--steps 10", "--steps is no option"),
    "few vertices": ("--remesh 3", "--remesh"),
    "another placement": ("--placement odd", "--placement"),
}


@pytest.mark.parametrize("name", BAD_APPLIES)
def test_bad_applies(files, run, name, capsys):
    words, message = BAD_APPLIES[name]
    check_refused(files, apply(words), message, capsys)


def test_options_of_geometric_textures_mean_nothing_to_others(files, capsys):
    words = ["apply", "pebbles", "--mesh", "good.obj", "--out", "out/a.glb", "--start-level", "1"]
    check_refused(files, words, "--start-level is no option of nca textures", capsys)


def test_too_many_faces(files, run, capsys, monkeypatch):
    monkeypatch.setattr("mitex.methods.geometric.texture.MOST_FACES", 47)
    check_refused(files, apply("--start-level 0"), "remesh it more coarsely", capsys)


@pytest.mark.parametrize("command", ["apply", "animate"])
def test_what_can_be_told_before_remeshing(files, run, capsys, monkeypatch, command):
    monkeypatch.setattr("mitex.mesh.remesh", None)
    words = apply if command == "apply" else animate
    for options, message in {
        "--remesh 2000000 --start-level 0": "would have 16,000,000 faces after level 1",
        "--remesh 200 --end-level 5": "levels",
        "--remesh 200 --start-level 0 --field up": "leave it out",
    }.items():
        check_refused(files, words(options), message, capsys)


def test_an_unfinished_run(files, run, capsys):
    (run / "texture.safetensors").unlink()
    check_refused(files, apply(), "which can be resumed", capsys)


def test_a_damaged_model(files, run, capsys):
    bad.cut(run / "texture.safetensors")
    check_refused(files, apply(), "geometric texture", capsys)


def test_an_unknown_reference_is_answered_with_the_names(files, capsys):
    fit = ["fit", "geometric", "--out", "out/run", "--reference"]
    check_refused(files, [*fit, "spikse"], "there is no mesh spikse; did you mean spikes?", capsys)
    check_refused(files, [*fit, "nothing.obj"], "one of spikes, scales, knobs, ridges", capsys)
