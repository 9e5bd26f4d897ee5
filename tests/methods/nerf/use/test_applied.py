"""A texture on a user's mesh: where each texel comes to lie, and what its parameters change."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.mesh import grid, icosphere
from mitex.methods.nerf.synthesis.maps import LatentMaps
from tests.methods.nerf.small import small_maps, small_texture


def repeated(maps: LatentMaps, rows: int, columns: int) -> LatentMaps:
    """The same endless texture, in larger maps."""
    return replace(
        maps,
        features=np.tile(maps.features, (rows, columns, 1)),
        frame=np.tile(maps.frame, (rows, columns)),
    )


@pytest.mark.parametrize(("rows", "columns"), [(1, 2), (3, 1), (2, 3)])
@pytest.mark.parametrize("mesh", [grid(6, 6), icosphere(4)], ids=["grid", "ball"])
def test_textures_that_are_not_square_keep_their_proportions(mesh, rows, columns):
    texture, square = small_texture(), small_maps()
    points = np.random.default_rng(0).uniform(-0.9, 0.9, (4000, 3)).astype(np.float32)
    expected, density = (
        texture.apply(mesh, maps).density(points) for maps in (square, repeated(square, rows, columns))
    )
    assert (expected > 0).sum() > 100
    np.testing.assert_allclose(density, expected, rtol=2e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scale": 0.0}, "`scale` 0 is out of range"),
        ({"scale": math.nan}, "`scale` nan is out of range"),
        ({"scale": 0.0, "guide": np.zeros((4, 4, 3))}, "`scale` 0 is out of range"),
        ({"density": 0.0}, "`density` 0 is out of range"),
        ({"lift": 1.5}, "`lift` 1.5 is out of range"),
        ({"light": np.zeros(9)}, r"a light of shape \(9,\)"),
        ({"light": np.full(16, np.inf)}, "a light"),
    ],
)
def test_options_are_checked_before_a_texture_is_synthesized(options, message, monkeypatch):
    texture = small_texture()
    monkeypatch.setattr(texture, "synthesize", lambda *_, **__: pytest.fail("synthesized"))
    with pytest.raises(ConfigError, match=message):
        texture.apply(icosphere(2), **options)


def test_the_side_under_a_guide_needs_a_scale():
    with pytest.raises(ConfigError, match="`scale` 0 is out of range"):
        small_texture().covering(icosphere(2), scale=0.0)
