"""The script puts the numbers of several comparisons into two tables, and their pictures on a sheet."""

import csv
import sys
from importlib import import_module
from pathlib import Path

import pytest

from mitex.comparison.measures import COSTS, LOOKS
from mitex.images import read_image
from tests.cli import bad_files as bad

ROOT = Path(__file__).parents[2]


@pytest.fixture
def script(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    script = import_module("make_comparison_sheet")
    monkeypatch.setattr(script, "GALLERY", tmp_path)
    monkeypatch.setattr(script, "PAIRS", tmp_path / "pairs.csv")
    return script


def comparison(folder, exemplar, numbers):
    """A folder of a comparison of one method with two seeds on two meshes: (mesh, seed) -> its numbers."""
    keys = [measure.key for measure in (*LOOKS, *COSTS)]
    (folder / "measured").mkdir(parents=True)
    with (folder / "report.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, ["exemplar", "mesh", "method", "seed", *keys, "asset"], restval="")
        writer.writeheader()
        for (mesh, seed), values in numbers.items():
            id = f"apply-a-{mesh}-{seed}"
            bad.image(folder / "measured" / f"{id}.jpg", (16, 16), "JPEG")
            names = {"exemplar": exemplar, "mesh": mesh, "method": "a", "seed": seed}
            writer.writerow({**names, **values, "asset": f"batch/results/{id}/{mesh}.glb"})
    return str(folder)


def lines(printed):
    """First cells of a line -> all others."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in printed if "|" in line]
    return {row[0]: row[2:] for row in rows if row[1] == "`a`"}


def test_likeness_and_costs(script, tmp_path, monkeypatch, capsys):
    """Over meshes first, then over seeds: gram 2 and 4; 30 and 50 s, 1.2 million parameters, 1.5 GB.

    Repetition is 0.4 and -0.2 with one seed, a distance of 0.3, and 0.47 and -0.33 with the other, of 0.4.
    """

    def costs(seconds):
        return {"fit_seconds": seconds, "parameters": 1_200_000.0, "memory": 1.5e9}

    lava = {
        ("ball", 0): {"gram": 1.0, "repetition": 0.4, **costs(20)},
        ("vase", 0): {"gram": 3.0, "repetition": -0.2, **costs(40)},
        ("ball", 1): {"gram": 4.0, "repetition": 0.47, **costs(50)},
        ("vase", 1): {"gram": 4.0, "repetition": -0.33, **costs(50)},
    }
    folders = [comparison(tmp_path / "lava", "lava", lava)]
    folders.append(comparison(tmp_path / "rust", "rust", {("ball", 0): {"gram": 5.0, **costs(1)}}))
    options = ["--methods", "a", "--mesh", "ball", "--", *folders]
    monkeypatch.setattr(sys, "argv", ["make_comparison_sheet.py", *options])
    script.main()
    likeness, spent = (part.splitlines() for part in capsys.readouterr().out.split("\n\n")[:2])
    assert all(measure.label in likeness[0] for measure in LOOKS) and "Gram" not in spent[0]
    gram = 3
    assert lines(likeness)["lava"][gram] == "3.00 ± 1.4" and lines(likeness)["rust"][gram] == "5.00"
    assert lines(likeness)["lava"][0] == "–"
    assert "Repetition (mean distance from the best)" in likeness[0] and "| Gram |" in likeness[0]
    assert lines(likeness)["lava"][5] == "0.0850 ± 0.021 (0.350 ± 0.071)"
    assert lines(likeness)["rust"][5] == "–"
    assert lines(spent)["lava"] == ["1,200,000", "40.0 ± 14", "–", "1.50"]
    assert lines(spent)["vase"][1] == "45.0 ± 7.1"
    assert read_image(tmp_path / "comparison.jpg").shape[2] == 3


def test_numbers_of_pairs_are_kept(script, tmp_path, monkeypatch):
    """A later run replaces its own pairs, and no others."""
    first = {(mesh, 0): {"gram": value} for mesh, value in (("vase", 1.0), ("ball", 2.0))}
    for name, numbers, pairs in (
        ("a", first, ["--pairs"]),
        ("b", {("vase", 0): {"gram": 3.14159}, ("vase", 1): {"gram": 5.0}}, ["--pairs"]),
        ("c", {("vase", 0): {"gram": 7.0}}, []),
    ):
        folder = comparison(tmp_path / name, "lava", numbers)
        options = ["--methods", "a", "--mesh", "vase", *pairs, "--", folder]
        monkeypatch.setattr(sys, "argv", ["make_comparison_sheet.py", *options])
        script.main()
    with (tmp_path / "pairs.csv").open(newline="") as file:
        rows = [(row["mesh"], row["seed"], row["gram"], row["transport"]) for row in csv.DictReader(file)]
    assert rows == [("ball", "0", "2", ""), ("vase", "0", "3.142", ""), ("vase", "1", "5", "")]
