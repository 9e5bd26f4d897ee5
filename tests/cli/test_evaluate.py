"""`mitex evaluate`: a texture is nearer to its own exemplar than to another, and to words that fit."""

import json

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.cli import main
from mitex.mesh import icosphere
from mitex.render.sides import sides


@pytest.fixture(scope="module")
def red(tmp_path_factory):
    """A red sphere."""
    mesh = icosphere(6)
    asset = Asset(mesh, {"albedo": np.tile(np.array([0.8, 0.1, 0.1], np.float32), (len(mesh.vertices), 1))})
    path = tmp_path_factory.mktemp("evaluate") / "red.glb"
    asset.export(path)
    return path


@pytest.fixture
def one_side(monkeypatch):
    """Pictures from the front alone: a sphere of one colour has no other sides."""
    monkeypatch.setattr("mitex.render.sides.AZIMUTHS", (0,))
    monkeypatch.setattr("mitex.render.sides.ELEVATIONS", (0.0,))


def numbers(capsys, *words: str) -> dict[str, float]:
    assert main(["evaluate", *words, "--json", "--quiet"]) == 0
    return json.loads(capsys.readouterr().out)


def test_words_that_fit_score_higher(one_side, red, capsys):
    right, wrong = (
        numbers(capsys, str(red), "--text", text, "--judge", "words") for text in ("plain red", "plain blue")
    )
    assert set(right) == {"MES", "MES-dir"}
    assert right["MES"] > wrong["MES"] and right["MES-dir"] > wrong["MES-dir"] + 20


def test_the_object_is_named_in_the_text(one_side, red, capsys):
    plain, ball = (
        numbers(capsys, str(red), "--text", "plain red", "--judge", "words", *words)
        for words in ((), ("--object", "red metal"))
    )
    assert plain != ball


def test_beside_a_reference(red, monkeypatch, capsys):
    """The ball is as smooth as itself, and not as a ball with spikes; the old options stay apart."""
    monkeypatch.setattr("mitex.evaluation.form.PATCHES", 2)
    monkeypatch.setattr("mitex.evaluation.form.SIZES", (1.0,))
    monkeypatch.setattr("mitex.evaluation.form.LAYERS", ("relu2_2",))
    monkeypatch.setattr("mitex.comparison.relief_pair.VIEWS", 1)
    near, far = (numbers(capsys, str(red), "--reference", name) for name in (str(red), "spikes"))
    assert near["Form"] < 0.01 and far["Form"] > 0.5
    assert near["Dihedral angles"] < far["Dihedral angles"]
    assert main(["evaluate", str(red), "--reference", "spikse"]) == 2
    assert "there is no mesh spikse" in capsys.readouterr().err


def test_beside_an_exemplar(red, tmp_path, capsys):
    from mitex.images import write_image

    for name, colour in {"red": [0.8, 0.1, 0.1], "blue": [0.1, 0.1, 0.8]}.items():
        picture = np.clip(np.array(colour) + np.random.default_rng(0).normal(0, 0.02, (96, 96, 3)), 0, 1)
        write_image(tmp_path / f"{name}.png", picture.astype(np.float32))
    near, far = (numbers(capsys, str(red), "--exemplar", str(tmp_path / f"{n}.png")) for n in ("red", "blue"))
    assert near["Transport"] < far["Transport"] and near["Fréchet, fine"] < far["Fréchet, fine"]


def test_the_table_says_which_way_better_lies(one_side, red, capsys):
    assert main(["evaluate", str(red), "--text", "plain red", "--judge", "words", "--quiet"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 and all(line.endswith("high is better") for line in lines)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "give --exemplar, --reference or --text"),
        (("--judge", "words", "--exemplar", "lava"), "--judge belongs to --text"),
        (("--object", "vase", "--exemplar", "lava"), "--object belongs to --text"),
        (("--text", "plain graay", "--judge", "words"), "did you mean gray?"),
        (("--text", "plain red", "--judge", "no-folder"), "no-folder"),
        (("--exemplar", "no-picture.png"), "no-picture.png"),
    ],
)
def test_refusals_are_one_line(words, message, red, capsys):
    assert main(["evaluate", str(red), *words, "--quiet"]) == 2
    error = capsys.readouterr().err.strip()
    assert "\n" not in error and message in error


def test_a_missing_asset_is_one_line(capsys):
    assert main(["evaluate", "nowhere.glb", "--text", "plain red", "--judge", "words"]) == 2
    error = capsys.readouterr().err.strip()
    assert "\n" not in error and "nowhere.glb" in error


def test_sides_go_all_around():
    mesh = icosphere(6)
    colours = (0.5 + 0.4 * mesh.vertices).astype(np.float32)
    pictures = sides(Asset(mesh, {"albedo": colours}), 32, spp=4)
    assert pictures.shape == (24, 32, 32, 3)
    middle = pictures[:, 12:20, 12:20].mean((1, 2))
    front, right, back = middle[8], middle[10], middle[12]
    assert front[2] > back[2] + 0.2 and right[0] > front[0] + 0.1  # +z towards the camera, then +x
    below, above = middle[:8].mean(0), middle[16:].mean(0)
    assert above[1] > below[1] + 0.1
