"""A texture on a user's mesh: where each texel comes to lie, and what its parameters change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

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
