"""Fits from words at the command line, of all methods that take them."""

import json
import os
from pathlib import Path

import pytest

from mitex.asset import clay
from mitex.cli import main
from mitex.mesh import icosphere
from tests.cli.handing_on import handed_on
from tests.cli.refusals import check_refused
from tests.features.clip.folders import write_folder

TINY = (
    "frequency=4 pool=1 view_count=1 resolution=16 text_bank=1 text_crops=1 surfaces=even min_steps=2 "
    "max_steps=2 steps=2 checkpoint_every=1 preview_every=0"
)


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder to work in, with a CLIP model and a mesh."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    monkeypatch.delenv("MITEX_CLIP", raising=False)
    write_folder(tmp_path / "clip")
    clay(icosphere(3)).export("ball.ply")
    return tmp_path


def test_from_words_to_a_file(files, capsys):
    words = ["fit", "nca", "--text", "Red dots, on red!", "--clip", "clip", "--quiet", "--set", *TINY.split()]
    assert main(words) == 0
    assert capsys.readouterr().out == "runs/red-dots-on-red\n"
    assert main([*words[:6], "--resume", "--steps", "3", "--out", "runs/red-dots-on-red", "--quiet"]) == 0
    apply = "apply runs/red-dots-on-red --mesh ball.ply --out ball.glb --resolution 64 --steps 2 --quiet"
    assert main([*apply.split(), "--displace", "--subdivide", "1"]) == 0
    assert (files / "ball.glb").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "given"),
    [
        ("", {"clip": None, "mesh": None, "init": None, "motion": None}),
        (
            "--clip clip --mesh ball.ply --init lava --motion right",
            {"clip": "clip", "mesh": "ball", "init": "lava", "motion": "right"},
        ),
    ],
)
def test_options_reach_an_automaton_from_words(files, monkeypatch, words, given):
    words = f"fit nca --text moss --quiet --out out --seed 4 --steps 9 --preset text {words}".split()
    (text, out), options = handed_on(monkeypatch, "mitex.methods.nca.fit_text", words)
    assert (text, out) == ("moss", Path("out"))
    assert sorted(options.pop("set")) == ["seed=4", "steps=9"]
    mesh = options.pop("mesh")
    assert {**options, "mesh": mesh and mesh.name} == {
        **{"preset": "text", "config": None, "on_step": None, "resume": False},
        **given,
    }


FITS = {
    "nca": "fit nca",
    "surface": "fit surface --mesh ball.ply",
    "text2mesh": "fit text2mesh --mesh ball.ply",
    "x_mesh": "fit x_mesh --mesh ball.ply",
}
every_method = pytest.mark.parametrize("method", FITS)


def test_from_words_to_a_surface_texture(files, capsys):
    """Also beside an exemplar, with the model that ships."""
    small = "resolution=32 exemplar_size=32 scales=0 layers=relu1_1 text_views=1 text_view=24 preview_every=0"
    words = ["fit", "surface", "--mesh", "ball.ply", "--clip", "words", "--quiet", "--set", *small.split()]
    text = ["--text", "Red dots, on white!", "--steps", "2"]
    assert main([*words, *text]) == 0
    assert capsys.readouterr().out == "runs/red-dots-on-white-ball\n"
    assert main([*words, *text, "--exemplar", "lava", "--out", "both"]) == 0
    assert main([*words, *text[:-1], "3", "--exemplar", "lava", "--out", "both", "--resume"]) == 0
    assert main(["apply", "both", "--out", "ball.glb", "--quiet"]) == 0
    assert (files / "ball.glb").stat().st_size > 3000


@every_method
class TestRefused:
    @pytest.mark.parametrize(
        ("words", "message"),
        [
            ("--text red --clip hub", "'hub' is no CLIP model: missing is the folder itself"),
            ("--text red --clip partial", "missing is model.safetensors"),
            ("--text red --clip damaged", "model.safetensors cannot be read"),
            ("--text red --clip other", "does not describe a CLIP model that Mitex can run"),
            ("--text red --clip mixed", "is not that of its model"),
            ("--text red --clip clip --out clip/config.json/run", "is a file"),
            ("--text red --clip clip --out locked/run", "locked' is not writable"),
            ("--text red --clip clip --mesh nothing", "there is no mesh"),
            ("--text frobs --clip words --set text_prompt={text}", "does not know the word 'frobs'"),
        ],
    )
    def test_bad_input(self, files, capsys, monkeypatch, method, words, message):
        (write_folder(files / "damaged") / "model.safetensors").write_bytes(b"damaged")
        (write_folder(files / "partial") / "model.safetensors").unlink()
        _change(write_folder(files / "other"), lambda config: config.update(model_type="siglip"))
        _change(write_folder(files / "mixed"), lambda config: config["text_config"].update(vocab_size=100))
        (files / "locked").mkdir()
        real, locked = os.access, files / "locked"  # the superuser may write everywhere
        monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != locked and real(path, mode))
        check_refused(files, [*FITS[method].split(), "--quiet", *words.split()], message, capsys)

    @pytest.mark.parametrize(
        ("text", "clip", "message"),
        [
            ("", "clip", "the text is empty"),
            (" ", "words", "the text is empty"),
            ("red " * 10_000, "clip", "tokens; give"),
            ("red " * 10_000, "words", "words; say it in 16 at most"),
        ],
    )
    def test_texts_of_no_use(self, files, capsys, method, text, clip, message):
        words = [*FITS[method].split(), "--quiet", "--text", text, "--clip", clip]
        check_refused(files, words, message, capsys)


def _change(folder: Path, change) -> None:
    config = json.loads((folder / "config.json").read_text())
    change(config)
    (folder / "config.json").write_text(json.dumps(config))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("nca", "--exemplar is missing; give --exemplar IMAGE, or --text WORDS"),
        ("nca --text red --exemplar lava", "--text and --exemplar contradict each other"),
        ("nca --exemplar lava --mesh vase", "--mesh means nothing without --text"),
        ("nca --exemplar lava --clip clip", "--clip means nothing without --text"),
        ("nca --text red --clip clip --preset paper", "the preset paper is for exemplars, not for words"),
        ("surface --mesh vase", "--exemplar is missing; give --exemplar IMAGE, or --text WORDS"),
        ("surface --mesh vase --exemplar lava --clip clip", "--clip means nothing without --text"),
        ("surface --tile 64 --text red", "--tile and --text contradict each other"),
        (
            "surface --mesh vase --text red --orientation a.npy",
            "--orientation means nothing without --exemplar",
        ),
        ("surface --mesh vase --text red --scale-map a.npy", "--scale-map means nothing without --exemplar"),
        ("surface --mesh vase --text red --clip clip --preset fast", "the preset fast is for exemplars"),
        (
            "surface --mesh vase --exemplar lava --preset text",
            "the settings are for words, not for an exemplar",
        ),
        ("text2mesh --mesh vase", "--exemplar is missing; give --exemplar IMAGE, or --text WORDS"),
        ("text2mesh --mesh vase --text red --exemplar lava", "--text and --exemplar contradict each other"),
        ("text2mesh --mesh vase --exemplar lava --clip clip", "--clip means nothing without --text"),
    ],
)
def test_options_that_do_not_go_together(files, capsys, words, message):
    check_refused(files, ["fit", *words.split(), "--quiet"], message, capsys)


def test_only_textures_with_a_relief_move_a_mesh(files, capsys):
    words = [
        "apply",
        "pebbles",
        "--mesh",
        "vase",
        "--out",
        "a.ply",
        "--displace",
        "--quiet",
        "--subdivide",
        "0",
    ]
    check_refused(files, words, "the texture has no relief that could displace a mesh", capsys)
