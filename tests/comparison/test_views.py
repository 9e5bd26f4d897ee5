"""A plain field beside a captured texture: from photos to the report, in which what it lacks is empty."""

import csv
import json
import re
from dataclasses import asdict

import numpy as np
import pytest

from mitex.cli import main
from mitex.comparison.measures import CAPTURES, COSTS
from mitex.comparison.store import Store
from mitex.evaluation.views import view_quality
from mitex.images import read_image
from mitex.methods.baselines.plain_field import PlainFieldTexture
from mitex.methods.nerf.capture.capture import load_capture
from mitex.methods.nerf.field.rendering import render_view, render_views
from tests.cli import bad_files as bad
from tests.comparison.conftest import small_capture

COMMON = ["rays=512", "table=11", "occupancy=32", "ray_steps=96", "steps=2", "preview_every=0"]
BASE = ["base_mesh=base.obj", "base_steps=150", "coarsest=8", "finest=32"]
METHODS = {"nerf": [*COMMON, *BASE, "apply.size=128", "apply.density=200"], "plain_field": COMMON}
OF_PLAIN = {"psnr", "ssim", "vgg", "parameters", "fit_seconds", "memory"}


@pytest.fixture
def compared(small, planes_alike, own_cache, place, monkeypatch):
    """The folder of a comparison of both on two meshes, in which all planes are alike."""
    bad.text(place / "cube.obj", bad.CUBE)
    small_capture(place, monkeypatch)
    compare()
    return place / "out"


def compare():
    settings = [f"{name}:{setting}" for name, own in METHODS.items() for setting in own]
    words = ["--exemplar", "photos", "--mesh", "ball.obj", "cube.obj", "--methods", ",".join(METHODS)]
    assert main(["compare", *words, "--set", *settings, "--out", "out", "--quiet"]) == 0


def test_a_plain_field_is_compared_by_its_views(compared, monkeypatch):
    check_table(compared)
    check_means(compared)
    check_page(compared)
    monkeypatch.setattr(Store, "measure", None)  # what is known is not measured again
    compare()


def check_table(folder):
    with (folder / "report.csv").open() as file:
        *others, plain = csv.DictReader(file)
    assert [row["mesh"].rpartition("/")[2] for row in (*others, plain)] == ["ball.obj", "cube.obj", ""]
    assert {key for key in plain if plain[key]} == OF_PLAIN | {"exemplar", "method", "seed", "run"}
    of_others = OF_PLAIN | {"plane_0", "planes", "apply_seconds", "asset"}
    assert all(row[key] for row in others for key in of_others)
    texture, (_, held_out) = PlainFieldTexture.load(folder / plain["run"]), load_capture("photos").split()
    expected = asdict(view_quality(render_views(texture.field, held_out)))
    assert {key: float(plain[key]) for key in expected} == pytest.approx(expected, rel=1e-4)
    assert float(plain["parameters"]) == sum(value.numel() for value in texture.parameters.values())
    (file,) = (folder / "measured").glob("fit-plain_field-*-view.jpg")
    view, _ = render_view(texture.field, held_out, 0)
    assert np.abs(read_image(file) - view).mean() < 0.02


def check_means(folder):
    """Of both meshes and over them."""
    record = json.loads((folder / "report.json").read_text())
    plain = record["results"][-1]
    assert (plain["method"], plain["mesh"], plain["asset"]) == ("plain_field", None, None)
    assert len(record["means"]) == 3
    for table in record["means"]:
        cells = {cell["measure"]: cell["mean"] for cell in table["cells"] if cell["method"] == "plain_field"}
        assert cells == {key: plain[key] for key in OF_PLAIN}


def check_page(folder):
    html = (folder / "report.html").read_text()
    rows = re.findall('<tr><td data-value="plain_field">plain_field</td>(.*?)</tr>', html)
    empty = len((*CAPTURES, *COSTS)) - len(OF_PLAIN)
    assert [row.count('<td data-value="">–</td>') for row in rows] == [empty] * 3
    (looks,) = re.findall('<table class="looks".*?</table>', html, re.DOTALL)
    alts = re.findall('<img [^>]*alt="(.*?)"', looks)
    assert alts == [
        "exemplar photos",
        *(f"photos, view held out, by {name}, seed 0" for name in METHODS),
        *(f"photos on {mesh} by nerf, seed 0" for mesh in ("ball", "cube")),
    ]
    assert f"<td>plain_field</td><td>{', '.join(COMMON).replace('=', ' = ')}</td><td>–</td>" in html
    assert looks.count('<td class="none">–</td>') == 2 and "not done" not in looks
