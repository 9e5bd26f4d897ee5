"""Displacements that pierce are drawn back, the others stay."""

import logging

import numpy as np
import pytest

from mitex.errors import MeshWarning
from mitex.mesh import Mesh, grid
from mitex.mesh.self_intersections import piercing_pairs
from mitex.mesh.untangling import untangled


def plates(gap: float) -> Mesh:
    """Two square plates above each other that look away from each other."""
    plate = grid(12, 12)
    below = plate.vertices - np.array([0.013, 0.027, gap])  # no edges above edges
    return Mesh(
        np.concatenate([plate.vertices, below]),
        np.concatenate([plate.faces, plate.faces[:, ::-1] + len(plate.vertices)]),
    )


def dented(mesh: Mesh, depth: float) -> Mesh:
    """The upper plate pushed down in the middle of its left half, and up in the middle of the right one."""
    x, y, z = mesh.vertices.astype(np.float64).T
    bump = np.exp(-((np.abs(x) - 0.5) ** 2 + y**2) / 0.04) * np.sign(x) * (z > -1e-6)
    return mesh.with_vertices(mesh.vertices + depth * bump[:, None] * np.array([0, 0, 1]))


def test_what_pierces_is_drawn_back_and_nothing_else(caplog):
    before = plates(0.1)
    after = dented(before, 0.4)
    with caplog.at_level(logging.INFO):
        result = untangled(before, after)
    first = len(piercing_pairs(after))
    assert first > 10 and len(piercing_pairs(result)) == 0
    assert f": 0, before {first}, without the relief 0" in caplog.text
    right = before.vertices[:, 0] > 0.2
    assert np.array_equal(result.vertices[right], after.vertices[right])
    down = result.vertices[:, 2].min(initial=0, where=before.vertices[:, 2] > -1e-6)
    assert -0.1 < down < -0.02  # as deep as the gap allows, nearly


def test_a_mesh_that_pierces_itself_keeps_its_own():
    """Twice the target's own pairs may stay: with a deeper dent in a mesh that is dented already."""
    before = dented(plates(0.1), 0.3)
    after = dented(plates(0.1), 0.32)
    own, more = len(piercing_pairs(before)), len(piercing_pairs(after))
    assert 0 < own <= more <= 2 * own
    assert untangled(before, after) is after


def test_what_stays_after_some_rounds_is_counted_anew(caplog, monkeypatch):
    """Only pairs with faces that moved are looked for in a round."""
    monkeypatch.setattr("mitex.mesh.untangling.ROUNDS", 2)
    before = plates(0.1)
    after = dented(before, 0.4)
    with caplog.at_level(logging.INFO), pytest.warns(MeshWarning, match="still pierce each other, 0 without"):
        result = untangled(before, after)
    left = len(piercing_pairs(result))
    assert 0 < left < len(piercing_pairs(after)) and f": {left}, before" in caplog.text
