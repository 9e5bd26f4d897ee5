"""The measure of form ranks references as an eye does: themselves, copies, others, lumps, a ball."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

from mitex.evaluation.form import ReliefForm
from mitex.mesh import icosphere
from mitex.methods.geometric.references import find_reference

pytestmark = pytest.mark.slow
TOOLS = Path(__file__).parents[2] / "tools"
NAMES = ("spikes", "knobs", "craters")


@pytest.fixture
def tool(monkeypatch):
    """What draws the sheet of forms, which knows lumps and copies."""
    monkeypatch.syspath_prepend(str(TOOLS))
    monkeypatch.delitem(sys.modules, "make_form_sheet", raising=False)
    return import_module("make_form_sheet")


@pytest.mark.parametrize("name", NAMES)
def test_ranks_of_a_reference(tool, name):
    pytest.importorskip("pymeshlab")
    reference = find_reference(name)
    measure = ReliefForm(reference)
    itself = measure.at(reference, seed=1).distance
    copy = measure.of(tool.cut(reference)).distance
    others = [measure.of(find_reference(other)).distance for other in NAMES if other != name]
    lumps, ball = measure.of(tool.lumps()).distance, measure.of(icosphere(tool.FREQUENCY)).distance
    assert itself < copy < min(others) and copy < lumps < ball
