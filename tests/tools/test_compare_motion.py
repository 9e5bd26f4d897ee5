"""The tool that measures how textures flow, on textures whose motion is known."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import torch

from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture
from tests.methods.nca import tiny

TOOLS = Path(__file__).parents[2] / "tools"


@pytest.fixture
def tool(monkeypatch):
    monkeypatch.syspath_prepend(str(TOOLS))
    monkeypatch.delitem(sys.modules, "compare_motion", raising=False)
    return import_module("compare_motion")


@pytest.fixture
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
    assert direction < 5 and 0.85 < ratio < 1.03 and looks == []


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
