"""Running a command that must be refused, and what is checked then."""

import os
import subprocess
import sys
from pathlib import Path

from mitex.cli import main
from tests.cli import bad_files as bad

ROOT = Path(__file__).parents[2]
QUICK = (
    "--set frequency=4 pool=1 view_count=1 resolution=32 target_size=32 exemplar_size=32 "
    "hidden=8 min_steps=2 max_steps=2 steps=2 checkpoint_every=1 preview_every=0 layers=relu1_1 "
    "zooms=1 order_weight=0 decoder_width=8"
)


def fit(words, files, exemplar="good.png", out="out/run"):
    bad.image(files / "good.png")
    return f"fit nca --exemplar {exemplar} --out {out} --quiet {words}".split()


def apply(words="", mesh="good.obj", model="pebbles", out="out/a.glb"):
    return f"apply {model} --mesh {mesh} --out {out} {words}".split()


def tree(folder: Path) -> dict[str, int]:
    return {str(path.relative_to(folder)): path.stat().st_size for path in folder.rglob("*")}


def check_refused(files, words, message, capsys):
    """Runs `mitex words` in `files`."""
    before = tree(files)
    assert main(words) == 2
    printed = capsys.readouterr()
    check_complaint(printed.out, printed.err, message)
    assert tree(files) == before


def check_complaint(out, err, message):
    errors = [line for line in err.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1 and message in errors[0] and "; " in errors[0], err
    assert all(line.startswith(("error: ", "warning: ")) for line in err.splitlines()), err
    assert not out


def program(words, **options):
    """The real program in a process of its own, working in the current folder."""
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-m", "mitex", *words.split()],
        capture_output=True,
        text=True,
        env=os.environ | threads,
        **options,
    )
