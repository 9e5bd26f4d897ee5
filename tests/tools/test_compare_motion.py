"""The tool that measures how textures flow, on textures whose motion is known."""

import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.mesh import Mesh, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from tests.methods.nca import tiny

TOOLS = Path(__file__).parents[2] / "tools"


@pytest.fixture(scope="module")
def tool():
    """With half of the close-ups."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TOOLS))
        patch.delitem(sys.modules, "compare_motion", raising=False)
        tool = import_module("compare_motion")
        patch.setattr(tool, "VIEWS", 3)
        yield tool


@pytest.fixture(scope="module")
def closeups(tool):
    return tool.CloseUps.of(icosphere(40))


MOTION = NcaTexture.motion


def _carried(closeups, **about) -> NcaTexture:
    """A texture that does nothing by itself: a pattern of waves that the field carries."""
    texture = NcaTexture(tiny.texture(shape=None).look, {"name": "tiny", "growth_steps": 1} | about)
    for weight in texture.look.rule.parameters():
        weight.data.zero_()
    places = torch.from_numpy(closeups.cells.mesh.vertices.astype(np.float64))
    waves = [(14 * places @ places.new_tensor(way)).sin() for way in ([1, 2, 1], [-1, 1, 2], [2, -1, 1])]
    state = torch.cat([0.4 * torch.stack(waves, 1), places.new_zeros(len(places), 13)], 1)
    texture.look.rule.seed = lambda operator: state.float()[None]  # pyright: ignore[reportAttributeAccessIssue]
    return texture


@pytest.mark.parametrize(
    ("field", "judge"),
    [("about-y", "lucas-kanade"), ("right", "lucas-kanade"), ("shear-up", "lucas-kanade"), ("right", "flow")],
)
def test_what_is_carried_moves_as_it_should(tool, closeups, field, judge):
    """The first judge's regulariser takes about a tenth of the speed off."""
    with torch.no_grad():
        direction, ratio, looks = tool.motion_of(_carried(closeups), closeups, field, (), judge)
    assert direction < 4 and 0.86 < ratio < 1.03 and looks == []


def test_the_speed_is_that_of_the_period(tool, closeups, monkeypatch):
    """What is carried in 12 steps as far as it should be in 6 is half as fast."""
    texture = _carried(closeups)
    slow = NcaTexture(texture.look, dict(texture.about) | {"motion_period": 12.0})
    monkeypatch.setattr(NcaTexture, "motion", lambda self, *arguments: MOTION(slow, *arguments))
    with torch.no_grad():
        assert 0.37 < tool.motion_of(texture, closeups, "about-y", ())[1] < 0.51


def test_places_where_the_field_is_weak_do_not_count(tool, closeups):
    vertices = closeups.cells.mesh.vertices
    weak = vertices[:, 0] < 0
    field = np.where(weak[:, None], 0.05, 1.0) * np.array([0.0, 1.0, 0.0])
    moving = closeups.moving(field)
    assert moving.shape == closeups.covered.shape
    x = closeups._image(vertices[closeups.cells.mesh.faces[closeups.face]].mean(1))[..., 0]
    assert moving[x > 0.1].all() and not moving[x < -0.1].any()


@pytest.fixture
def pictured(tool, closeups, monkeypatch):
    """A texture whose close-ups are squares of an exemplar, each repeated and as wide as it is there."""
    bricks = Exemplar.load("bricks").resized(32).maps["albedo"]
    pictures = np.tile(bricks, (len(closeups.cameras), 4, 4, 1))
    monkeypatch.setattr(tool.CloseUps, "pictures", lambda *_: pictures)
    about = {"name": "tiny", "growth_steps": 1, "density": 8, "exemplar": "bricks"}
    return NcaTexture(tiny.texture(shape=None).look, about)


def test_the_look_is_far_from_another_exemplar_alone(tool, closeups, pictured):
    """By the same measure for a still texture."""
    other = NcaTexture(pictured.look, {**pictured.about, "exemplar": "lava"})
    with torch.no_grad():
        own, others = (tool.still_distance(texture, closeups) for texture in (pictured, other))
        growth = pictured.growth(closeups.cells)
        assert tool.distance(pictured, closeups, growth, growth.seed()) == own
    assert 0 < 10 * own < others


def test_a_still_texture_is_compared_once_it_is_in_order(tool, closeups, monkeypatch):
    texture, states = tiny.texture(shape=None), []
    slow = NcaTexture(texture.look, {"name": "slow", "growth_steps": 3})
    monkeypatch.setattr(tool, "distance", lambda *arguments: states.append(arguments[-1]) or 0.5)
    with torch.no_grad():
        assert tool.still_distance(slow, closeups) == 0.5
    assert torch.equal(states[0], slow.grow(closeups.cells.mesh, seed=0, steps=3))


def test_the_table_has_a_row_for_each_mesh_model_and_field(tool, tmp_path, monkeypatch, capsys):
    """Looks are told relative to those of the still model, if one is named."""
    monkeypatch.chdir(tmp_path)
    for name, seed in (("moving", 0), ("still", 1)):
        texture = tiny.texture(shape=None, seed=seed)
        NcaTexture(texture.look, {"name": name}).save(f"{name}.safetensors")
    calls = []

    def measured(texture, closeups, field, later, judge):
        calls.append((texture.about["name"], len(closeups.cells.mesh.faces), field, later, judge))
        return 12.4, 0.876, [1.0, 2.0, 5.0][: len(later)]

    monkeypatch.setattr(tool, "motion_of", measured)
    monkeypatch.setattr(tool, "still_distance", lambda texture, _: {"still": 4.0}[texture.about["name"]])
    monkeypatch.setattr(tool.CloseUps, "of", lambda mesh: SimpleNamespace(cells=Cells(mesh, 0, mesh)))
    words = "moving.safetensors:still.safetensors moving.safetensors --fields up about-x --meshes sphere vase"
    monkeypatch.setattr(sys, "argv", ["compare_motion.py", *words.split(), "--judge", "flow"])
    tool.main()
    rows = capsys.readouterr().out.splitlines()
    assert rows[0].startswith("| texture | mesh | field | direction | speed | look after 50 |")
    assert rows[2:6] == [
        "| moving | sphere | up | 12° | 0.88 | 0.25 | 0.50 | 1.25 |",
        "| moving | sphere | about-x | 12° | 0.88 | 0.25 | 0.50 | 1.25 |",
        "| moving | sphere | up | 12° | 0.88 |  |  |  |",
        "| moving | sphere | about-x | 12° | 0.88 |  |  |  |",
    ]
    assert [row.split(" | ")[1:3] for row in rows[6:]] == 2 * [["vase", "up"], ["vase", "about-x"]]
    faces = [20 * 32**2] * 4 + [len(Mesh.load("vase").faces)] * 4
    fields, later = 4 * ["up", "about-x"], 2 * ([tool.LATER] * 2 + [()] * 2)
    assert calls == [("moving", *call, "flow") for call in zip(faces, fields, later, strict=True)]
