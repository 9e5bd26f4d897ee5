"""The box that is taken off a captured texture, and its pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.methods.baselines.nerf_tex.box import (
    main_direction,
    most_typical,
    picture_box,
    possible_cells,
    take_box,
)
from mitex.methods.nerf.field.lighting import rotated, shade
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.methods.nerf.synthesis.patches import extract_patches
from mitex.methods.nerf.use.placement import EXTENT
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload
from tests.methods.baselines.nerf_tex.small import captured


def test_a_piece_lies_in_its_box(box):
    """As wide as `EXTENT`, as thick as the shell, and of the captured size; nothing is beside it."""
    texture = captured()
    base = texture.model.base
    squares = extract_patches(base.mesh, np.random.default_rng(0), count=8, size=128, scan=base.scan)
    assert box.half == pytest.approx(0.5 * squares.length / EXTENT)
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    thick = box.field.thickness
    assert thick == pytest.approx(base.thickness / box.half)
    outside = (np.abs(points[:, :2]) > EXTENT).any(1) | (np.abs(points[:, 2]) > thick)
    density = box.field.density(points)
    assert (density[outside] == 0).all() and (density[~outside] > 0).mean() > 0.99
    filled = np.argwhere(np.array(box.field.mask))
    cells = possible_cells(box, 24)
    places = (filled + np.random.default_rng(1).random(filled.shape)) * (24 / len(box.field.mask))
    assert cells[tuple(places.astype(int).T)].all() and not cells.all()


def test_the_most_typical_piece_is_taken():
    """Of squares whose features are their places, the one nearest to the middle of all."""
    ball = icosphere(12)
    squares = extract_patches(ball, np.random.default_rng(0), count=40, size=16)
    texture: Any = type("Places", (), {"features": staticmethod(lambda p: np.tile(p, (1, 8)))})()
    means = squares.points[:, ::8, ::8].mean((1, 2))
    assert most_typical(texture, squares) == np.linalg.norm(means - means.mean(0), axis=1).argmin()


def test_boxes_that_hold_nothing_are_refused():
    with pytest.raises(ConfigError, match="raise `patch` to"):
        take_box(captured(), 16, 0)


def test_most_light_comes_from_its_main_direction():
    """The side of a ball that faces there is brightest, however the light is turned."""
    rng = np.random.default_rng(0)
    light = np.zeros(16)
    light[:4] = 4.0, *rng.normal(size=3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    normals = icosphere(20).vertices.astype(np.float32)
    for coefficients, direction in (
        (light, main_direction(light)),
        (rotated(light, turn), turn @ main_direction(light)),
    ):
        normal, one = channels(mi.Vector3f, normals), mi.Float(1)
        shown = shade(
            normal, -normal, one, one * 0, one, upload(mi.TensorXf, coefficients.astype(np.float32))
        )
        assert normals[rows(shown)[:, 0].argmax()] @ direction > 0.99
    assert main_direction(np.array([4.0] + [0.0] * 15)).tolist() == [0, 0, 1]


def test_pictures_show_the_box_under_turned_lights(box):
    pictures, lights = picture_box(box, 5, 8, 0)
    assert len(pictures) == 5 and lights.shape == (5, 3)
    assert np.abs(np.linalg.norm(lights, axis=1) - 1).max() < 1e-5
    assert (pictures.poses[:, 2, 3] > 0).all()
    middle = np.array([[4.0, 4.0]])
    for view in range(5):
        origins, directions = pictures.rays(view, middle)
        assert np.abs(np.cross(origins[0], directions[0])).max() < 1e-4  # it looks at the middle
        assert pictures.images[view][..., 3].max() > 100 and pictures.images[view][0, 0, 3] == 0
    again, turned = picture_box(box, 5, 8, 0)[0], picture_box(box, 5, 8, 1)[1]
    assert (again.images[3] == pictures.images[3]).all() and np.abs(turned - lights).max() > 0.1
