"""What shows of the triangles."""

import numpy as np
import pytest

from mitex.evaluation.triangle_pattern import places, triangle_share

RNG = np.random.default_rng(0)
GRID = places()


def test_places_are_on_the_triangle_its_border_included():
    assert GRID.shape == (28, 3) and GRID.min() == 0
    np.testing.assert_allclose(GRID.sum(axis=1), 1, rtol=1e-6)
    assert len(np.unique(GRID.round(5), axis=0)) == 28


def test_a_pattern_of_the_triangle_alone_explains_all():
    bump = GRID.prod(axis=1)
    assert triangle_share(np.tile(bump[None, :, None], (50, 1, 1))) == pytest.approx(1.0)


def test_noise_explains_nothing():
    assert triangle_share(RNG.normal(size=(4000, 28, 2))) < 1e-3


def test_shares_add_up():
    bump = GRID.prod(axis=1)
    noise = RNG.normal(size=(4000, 28, 1)) * bump.std()
    assert triangle_share(noise + bump[None, :, None]) == pytest.approx(0.5, abs=0.02)


def test_corners_have_no_order():
    """A value that grows towards the first corner is, over faces that begin anywhere, no pattern."""
    turned = [np.roll(GRID, int(k), axis=1)[:, 0] for k in RNG.integers(0, 3, 4000)]
    assert (
        triangle_share(np.stack(turned)[..., None] - 1 / 3)
        < 0.02 + triangle_share(np.tile(np.sort(GRID, axis=1)[None, :, :1], (10, 1, 1))) * 1e-3
    )
