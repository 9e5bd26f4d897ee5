"""`mitex fit nca --text` at the command line."""

import pytest

from mitex.asset import clay
from mitex.cli import main
from mitex.mesh import icosphere
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
    ("words", "message"),
    [
        ("", "--exemplar is missing; give --exemplar IMAGE, or --text WORDS"),
        ("--text red --exemplar lava", "--text and --exemplar contradict each other"),
        ("--exemplar lava --mesh vase", "--mesh means nothing without --text"),
        ("--exemplar lava --clip clip", "--clip means nothing without --text"),
        ("--text red --mesh nothing", "there is no mesh"),
        ("--text red --clip hub", "'hub' is no CLIP model: missing is the folder itself"),
        ("--text red --clip damaged", "model.safetensors cannot be read"),
        ("--text red --clip clip --out clip/config.json/run", "is a file"),
        ("--text red --clip clip --preset paper", "the preset paper is for exemplars, not for words"),
    ],
)
def test_bad_input(files, capsys, words, message):
    (write_folder(files / "damaged") / "model.safetensors").write_bytes(b"damaged")
    check_refused(files, f"fit nca --quiet {words}".split(), message, capsys)


@pytest.mark.parametrize("text", ["", "red " * 10_000])
def test_texts_of_no_use(files, capsys, text):
    check_refused(files, ["fit", "nca", "--text", text, "--clip", "clip", "--quiet"], "the text", capsys)


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
