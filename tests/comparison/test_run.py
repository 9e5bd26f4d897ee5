"""From exemplar and mesh to the report; what was done and measured is not done again; failures are listed."""

import csv
import json
import re
import time
import tomllib
from dataclasses import replace
from html import unescape
from types import SimpleNamespace
from typing import cast

import pytest

from mitex import __version__
from mitex.batch import Plan
from mitex.cli import main
from mitex.comparison import compare, comparison_plan
from mitex.comparison.kinds import Pair
from mitex.comparison.store import VERSION, Store, optimized_numbers
from tests.cli import bad_files as bad

QUILT = ["image_quilting:size=64", "image_quilting:exemplar_size=32", "image_quilting:block=12"]


def quilting(exemplars=("a.png",), seeds=1):
    return comparison_plan(exemplars, ["ball.obj"], ["image_quilting"], seeds=seeds, settings=QUILT)


@pytest.fixture
def measurings(monkeypatch):
    """Which results are measured."""
    measure, names = Store.measure, []

    def counted(self, result, *others):
        names.append(result.id.rpartition("-")[0])
        return measure(self, result, *others)

    monkeypatch.setattr(Store, "measure", counted)
    return names


@pytest.mark.usefixtures("small", "own_cache")
def test_a_comparison_goes_on_and_ends_in_files(place, measurings, capsys):
    """One call fails for a broken exemplar; the next one, with another seed, measures only what is new."""
    bad.text(place / "b.png")
    words = ["compare", "--exemplar", "a.png", "b.png", "--mesh", "ball.obj", "--methods", "image-quilting"]
    code = main([*words, "--set", *QUILT, "--out", "out", "--quiet"])
    printed = capsys.readouterr()
    assert code == 2 and "2 of 4 jobs are not done" in printed.err
    assert "failed   fit-image_quilting-b-s0: " in printed.out
    assert measurings == ["apply-image_quilting-a-s0-ball"]
    assert "fit-image_quilting-b-s0" in (place / "out" / "report.html").read_text()

    done = compare(quilting(seeds=2), place / "out")
    assert done.missing == 0 and measurings[1:] == ["apply-image_quilting-a-s1-ball"]
    check_files(place / "out")
    again = Plan.of(json.loads((place / "out" / "report.json").read_text())["plan"], place)
    assert compare(again, place / "out").missing == 0 and len(measurings) == 2


def check_files(folder):
    with (folder / "report.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["seed"] for row in rows] == ["0", "1"]
    for key in ("frechet_fine", "frechet_coarse", "transport", "gram", "seams", "fit_seconds", "memory"):
        assert all(float(row[key]) > 0 for row in rows), key
    assert all((folder / row["asset"]).is_file() for row in rows)
    record = json.loads((folder / "report.json").read_text())
    (table,) = record["means"]
    cells = {cell["measure"]: cell for cell in table["cells"]}
    assert cells["gram"]["mean"] == pytest.approx(sum(float(row["gram"]) for row in rows) / 2)
    assert cells["parameters"]["mean"] == 0
    check_provenance(folder, record, rows)
    html = (folder / "report.html").read_text()
    assert html.count("data:image/jpeg;base64,") == 3 and "http" not in html


def check_provenance(folder, record, rows):
    """What was asked for, and all settings that a fit had."""
    config = tomllib.loads((folder / rows[0]["run"] / "config.toml").read_text())
    assert record["settings"] == {"image_quilting": config} and config["tolerance"] == 0.1
    assert record["mitex"] == __version__ and record["date"] == time.strftime("%Y-%m-%d")
    html = (folder / "report.html").read_text()
    assert "<td>size = 64, exemplar_size = 32, block = 12</td><td>defaults</td>" in html
    assert "tolerance = 0.1\n" in html
    (text,) = re.findall("mitex compare --plan</summary><pre>(.*?)</pre>", html, re.DOTALL)
    assert tomllib.loads(unescape(text)) == record["plan"]


def test_numbers_of_another_version_judge_or_result_are_measured_again(tmp_path):
    from tests.comparison.test_summary import result

    store, one = Store(tmp_path), result("a", 0)
    clip, none = (cast(Pair, SimpleNamespace(judge=judge)) for judge in ("clip", None))
    assert store.load(one, none) is None
    bad.image(tmp_path / f"{one.id}-view.jpg", kind="JPEG")  # which is not all
    (tmp_path / f"{one.id}.json").write_text(json.dumps({"version": VERSION, "numbers": {}}))
    assert store.load(one, none) is None
    assert store.load(replace(one, asset=None), none) is not None
    bad.image(tmp_path / f"{one.id}.jpg", kind="JPEG")
    file = tmp_path / f"{one.id}.json"
    record = {"version": VERSION, "numbers": {"gram": 2.5}}
    for judge, pair, other in ((None, none, clip), ("clip", clip, none)):
        file.write_text(json.dumps(record | ({"judge": judge} if judge else {})))
        loaded = store.load(one, pair)
        assert loaded is not None and loaded.numbers["gram"] == 2.5
        assert store.load(one, other) is None
    for content in ({"version": VERSION - 1, "numbers": {}}, [], {"version": VERSION}):
        file.write_text(json.dumps(content))
        assert store.load(one, none) is None
    file.write_text(json.dumps(record | {"time": "2026-11-01"}))
    assert store.load(replace(one, time="2026-11-01"), none) is not None
    assert store.load(replace(one, time="2026-11-02"), none) is None
    file.write_text("{")
    assert store.load(one, none) is None


def test_what_a_fit_optimizes_is_counted_by_its_checkpoint(tmp_path):
    import numpy as np
    from safetensors.numpy import save_file

    assert optimized_numbers(tmp_path) == 0
    names = {
        "optimizer/first/0": (3, 4),
        "optimizer/first/1": (5,),
        "optimizer/second/0": (3, 4),
        "task/x": (9,),
    }
    arrays = {name: np.zeros(shape, np.float32) for name, shape in names.items()}
    save_file(arrays, tmp_path / "checkpoint.safetensors")
    assert optimized_numbers(tmp_path) == 17
