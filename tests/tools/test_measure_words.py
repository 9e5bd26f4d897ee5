"""Colours and patterns of known textures."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from mitex.mesh import icosphere

TOOLS = Path(__file__).parents[2] / "tools"


@pytest.fixture
def tool(monkeypatch):
    monkeypatch.syspath_prepend(str(TOOLS))
    for name in ("measure_words", "word_pictures", "word_patterns", "word_places"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return import_module("measure_words")


def test_colours_have_plain_names(tool):
    albedo = np.array([[0.85, 0.1, 0.1], [0.45, 0.05, 0.05], [0.05, 0.05, 0.05], [0.7, 0.75, 0.75]])
    assert tool.colour_names(albedo).tolist() == ["red", "red", "black", "grey"]
    assert tool.named("yellow stars on dark blue") == ["yellow", "blue"]


def test_twelve_dots(tool):
    """Around the corners of the icosahedron."""
    mesh, corners = icosphere(20), icosphere(1).vertices
    red = (mesh.vertices @ corners.T).max(1) > 0.95
    result = tool.measured(mesh, np.where(red, "red", "white"), "red", density=10)
    area = len(mesh.vertices) * 3**0.5 / 2  # in square edges
    assert result.pieces == pytest.approx(12 * 100 / area)
    assert result.shares["red"] == pytest.approx(red.mean()) and set(result.shares) == {"red", "white"}


def test_stripes_across(tool):
    """Six of each colour from pole to pole, so that three are a third of half a turn."""
    mesh = icosphere(30)
    angle = np.arccos(np.clip(mesh.vertices[:, 1], -1, 1))
    names = np.where((angle * 12 / np.pi).astype(int) % 2 == 0, "green", "yellow")
    length = mesh.edge_lengths.mean()
    result = tool.measured(mesh, names, "green", density=np.pi / 2 / length)
    assert result.across == pytest.approx(3, rel=0.1)
