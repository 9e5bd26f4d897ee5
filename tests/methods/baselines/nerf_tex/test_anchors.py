"""Where boxes stand on a mesh."""

from __future__ import annotations

import numpy as np
import pytest

from mitex.errors import ConfigError, MeshError
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.baselines.nerf_tex.anchors import place_anchors


def test_anchors_are_spread():
    ball = icosphere(20)
    anchors = place_anchors(ball, 0.2, 0.0, False, 0)
    gaps = np.linalg.norm(anchors.points[:, None] - anchors.points, axis=2) + 9 * np.eye(len(anchors))
    assert gaps.min() > 0.2
    places = np.random.default_rng(1).normal(size=(3000, 3))
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    assert np.linalg.norm(places[:, None] - anchors.points, axis=2).min(1).max() < 0.2 * 1.2
    up = anchors.points / np.linalg.norm(anchors.points, axis=1, keepdims=True)
    assert np.abs(anchors.frames[:, 2] - up).max() < 0.03
    assert np.abs(anchors.frames @ anchors.frames.swapaxes(1, 2) - np.eye(3)).max() < 1e-5
    assert (np.linalg.det(anchors.frames) > 0).all()


def test_both_sides_of_a_thin_plate_get_anchors():
    sheet = grid(12, 12)
    back = Mesh(sheet.vertices - [0, 0, 0.02], sheet.faces[:, ::-1], name="back")
    vertices = np.concatenate([sheet.vertices, back.vertices])
    plate = Mesh(vertices, np.concatenate([sheet.faces, back.faces + len(sheet.vertices)]), name="plate")
    up = place_anchors(plate, 0.3, 0.0, False, 0).frames[:, 2, 2] > 0
    assert 0.4 < up.mean() < 0.6 and up.sum() > 20


def test_tilt_and_turn_change_the_axes():
    sheet = grid(4, 4)
    straight = place_anchors(sheet, 0.1, 0.0, True, 0)
    assert np.abs(straight.frames - np.eye(3)).max() < 1e-6
    turned = place_anchors(sheet, 0.1, 0.0, False, 0)
    assert np.abs(turned.frames[:, 2] - [0, 0, 1]).max() < 1e-6
    angles = np.arctan2(turned.frames[:, 0, 1], turned.frames[:, 0, 0])
    assert abs(np.exp(1j * angles).mean()) < 0.2
    leaning = place_anchors(sheet, 0.1, 0.1, True, 0)
    angles = np.arccos(leaning.frames[:, 2, 2])
    assert angles.std() > 0.03 and np.sqrt(np.mean(angles**2) / 2) == pytest.approx(0.1, rel=0.15)


def test_anchors_are_refused():
    with pytest.raises(MeshError, match="no area"):
        place_anchors(grid(1, 1).with_vertices(np.zeros((4, 3))), 0.1, 0.0, True, 0)
    with pytest.raises(ConfigError, match="boxes on grid; use a larger scale"):
        place_anchors(grid(1, 1), 0.002, 0.0, True, 0)
