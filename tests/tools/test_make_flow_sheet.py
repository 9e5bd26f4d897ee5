"""What the sheet and the film of textures that flow show."""

import sys
from itertools import islice

import imageio.v3 as iio
import numpy as np
import pytest
import trimesh

from mitex.mesh import embedded, icosphere
from mitex.methods.nca import NcaTexture
from tests.methods.nca import tiny
from tools import make_flow_sheet as tool

BALL = icosphere(4)


@pytest.fixture
def small(monkeypatch):
    sizes = {"FREQUENCY": 4, "PICTURES": 2, "CELL": 24, "FRAMES": 3, "FILM_CELL": 24}
    for name, value in sizes.items():
        monkeypatch.setattr(tool, name, value)


def texture(name, seed=0):
    return NcaTexture(tiny.texture(seed=seed, shape=None).look, {"name": name, "growth_steps": 4})


def test_moments_are_so_many_steps_apart_along_the_field(small):
    slow = list(islice(tool.moments(texture("a"), "right", BALL, 1, 24), 3))
    fast = list(islice(tool.moments(texture("a"), "right", BALL, 2, 24), 2))
    other = list(islice(tool.moments(texture("a"), "about-y", BALL, 2, 24), 2))
    assert np.array_equal(slow[0], fast[0]) and np.array_equal(slow[2], fast[1])
    assert np.abs(fast[0] - fast[1]).max() > 0.01 and np.abs(fast[1] - other[1]).max() > 0.01


def test_scenes_are_fields_on_meshes(small, tmp_path):
    """A sphere, a mesh that ships, or one from a file; the name of a field may hold an equals sign."""
    trimesh.Trimesh(BALL.vertices, BALL.faces).export(tmp_path / "ball.ply")
    scenes = tool.meshes(["up=sphere", "about-y=vase", f"a=b.json={tmp_path / 'ball.ply'}"])
    assert list(scenes) == ["up", "about-y", "a=b.json"]
    assert len(scenes["up"].vertices) == len(scenes["a=b.json"].vertices) == len(BALL.vertices)
    assert np.array_equal(scenes["about-y"].vertices, embedded("vase").vertices)


def test_the_command_draws_a_row_for_each_model_and_scene(small, tmp_path, monkeypatch, capsys):
    sheets = []
    sheet = tool.sheet
    monkeypatch.setattr(tool, "sheet", lambda *p, **options: sheets.append(options) or sheet(*p, **options))
    models = [
        str(texture(name, seed).save(tmp_path / f"{name}.safetensors")) for seed, name in enumerate("ab")
    ]
    out, film = tmp_path / "sheet.png", tmp_path / "film.gif"
    fields = ["right", "about-y", "up"]
    scenes = ["--scenes", *(f"{field}=sphere" for field in fields)]
    monkeypatch.setattr(sys, "argv", ["make_flow_sheet", *models, *scenes, "--out", str(out)])
    tool.main()
    assert capsys.readouterr().out.split() == [str(out)] and iio.imread(out).ndim == 3
    rows = [f"{name}, {field}" for name in "ab" for field in fields]
    assert sheets[0]["columns"] == 2 and sheets[0]["labels"][::2] == rows
    assert sheets[0]["labels"][1::2] == 6 * [f"{tool.STEPS} steps later"]
    monkeypatch.setattr(sys, "argv", [*sys.argv, "--film", str(film)])
    tool.main()
    assert iio.imread(film).shape[:3] == (3, 48, 48)


def test_a_texture_that_follows_no_field_moves_as_it_was_trained(small):
    """One that was trained without the encoding, and is not carried: it has no field to be given."""
    own = NcaTexture(texture("a").look, {**texture("a").about, "motion": "right", "motion_advection": False})
    one, other = (list(islice(tool.moments(own, field, BALL, 2, 24), 2)) for field in ("right", "about-y"))
    assert np.array_equal(one, other) and np.abs(one[0] - one[1]).max() > 0.01
