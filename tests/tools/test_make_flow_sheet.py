"""What the sheet and the film of textures that flow show."""

import sys
from itertools import islice

import imageio.v3 as iio
import numpy as np
import pytest

from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture
from tests.methods.nca import tiny
from tools import make_flow_sheet as tool

MESHES = {"right": icosphere(4), "about-y": icosphere(4)}


@pytest.fixture
def small(monkeypatch):
    sizes = {"MESHES": MESHES, "PICTURES": 2, "CELL": 24, "FRAMES": 3, "FILM_CELL": 24}
    for name, value in sizes.items():
        monkeypatch.setattr(tool, name, value)


def texture(name, seed=0):
    return NcaTexture(tiny.texture(seed=seed, shape=None).look, {"name": name, "growth_steps": 4})


def test_moments_are_so_many_steps_apart_along_the_field(small):
    slow = list(islice(tool.moments(texture("a"), "right", 1, 24), 3))
    fast = list(islice(tool.moments(texture("a"), "right", 2, 24), 2))
    other = list(islice(tool.moments(texture("a"), "about-y", 2, 24), 2))
    assert np.array_equal(slow[0], fast[0]) and np.array_equal(slow[2], fast[1])
    assert np.abs(fast[0] - fast[1]).max() > 0.01 and np.abs(fast[1] - other[1]).max() > 0.01


def test_the_command_draws_a_row_for_each_model_and_field(small, tmp_path, monkeypatch, capsys):
    sheets = []
    sheet = tool.sheet
    monkeypatch.setattr(tool, "sheet", lambda *p, **options: sheets.append(options) or sheet(*p, **options))
    models = [
        str(texture(name, seed).save(tmp_path / f"{name}.safetensors")) for seed, name in enumerate("ab")
    ]
    out, film = tmp_path / "sheet.png", tmp_path / "film.gif"
    monkeypatch.setattr(sys, "argv", ["make_flow_sheet", *models, "--out", str(out)])
    tool.main()
    assert capsys.readouterr().out.split() == [str(out)] and iio.imread(out).ndim == 3
    rows = [f"{name}, {field}" for name in "ab" for field in MESHES]
    assert sheets[0]["columns"] == 2 and sheets[0]["labels"][::2] == rows
    assert sheets[0]["labels"][1::2] == 4 * [f"{tool.STEPS} steps later"]
    monkeypatch.setattr(sys, "argv", [*sys.argv, "--film", str(film)])
    tool.main()
    assert iio.imread(film).shape[:3] == (3, 48, 48)
