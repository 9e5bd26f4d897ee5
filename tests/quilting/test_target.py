"""What a patch covers: on surfaces by direction and size, on a square whose sides are joined."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.mesh import Mesh, grid
from mitex.quilting.matching import ArraySource
from mitex.quilting.surface import quilt_on
from mitex.quilting.target import SurfaceTarget, TileTarget

SIDE, PATCH = 64, 16
GAP = 2 / SIDE  # of a texel, on the square [-1, 1]^2


@pytest.fixture(scope="module")
def square() -> Mesh:
    return replace(grid(6, 6), name="square")


def covered(target: SurfaceTarget, row: int, column: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the map that a patch covers (M, 2), from the middle one, and where in the patch."""
    middle = int(np.flatnonzero(target.texels.index == row * SIDE + column)[0])
    texels, place, _ = target.around(middle)
    rows = np.stack(np.divmod(target.texels.index[texels], SIDE), axis=1)
    return rows - np.array([row, column]), place - 0.5 * (PATCH - 1)


@pytest.mark.parametrize(
    ("right", "turned"), [((1, 0, 0), np.eye(2)), ((0, 1, 0), np.array([[0, 1], [-1, 0]]))], ids=["x", "y"]
)
def test_a_patch_lies_as_directions_say(square: Mesh, right: tuple, turned: np.ndarray):
    """On the plane: its columns go along them, its rows to the right of that, as seen from the front."""
    directions = np.tile(np.array(right, float), (len(square.vertices), 1))
    offset, place = covered(SurfaceTarget(square, SIDE, PATCH, GAP, directions), 32, 32)
    assert len(offset) == pytest.approx(PATCH**2, rel=0.15)
    # Rows of the map go down, so y is minus the row; so do rows of the patch.
    x_y = np.stack([offset[:, 1], -offset[:, 0]], axis=1)
    np.testing.assert_allclose(np.stack([place[:, 0], -place[:, 1]], axis=1), x_y @ turned.T, atol=1e-4)


def test_angles_are_from_the_directions_to_the_patch(square: Mesh):
    """Around a point they turn, and a patch cannot follow."""
    x, y, _ = square.vertices.T
    target = SurfaceTarget(square, SIDE, PATCH, GAP, np.stack([-y, x, 0 * x], 1))
    texels, place, angle = target.around(int(np.flatnonzero(target.texels.index == 32 * SIDE + 44)[0]))
    row, column = np.divmod(target.texels.index[texels], SIDE)
    image = np.full((SIDE, SIDE, 2), np.nan)
    image[row, column] = place * [1, -1]
    a, c = np.asarray(np.gradient(image, axis=1))[row, column].T  # of the patch's x and y, by x
    b, d = -np.asarray(np.gradient(image, axis=0))[row, column].T  # and by y
    field = np.arctan2(column - 31.5, row - 31.5)
    error = np.arctan2(b - c, a + d) - field - angle
    inner = np.isfinite(error)
    assert inner.sum() > 150 and np.ptp(angle[inner]) > 0.5
    assert np.abs(np.sin(error[inner] / 2)).max() < 0.05


def test_a_patch_covers_more_where_the_pattern_is_larger(square: Mesh):
    sizes = np.ones((SIDE, SIDE))
    sizes[:, SIDE // 2 :] = 2.0
    target = SurfaceTarget(square, SIDE, PATCH, GAP, sizes=sizes)
    small, large = covered(target, 32, 15), covered(target, 32, 47)
    for (offset, place), size in ((small, 1), (large, 2)):
        np.testing.assert_allclose(place, offset[:, ::-1] / size, atol=1e-4)
        assert len(offset) == pytest.approx((size * PATCH) ** 2, rel=0.15)


def test_a_patch_on_a_tile_comes_in_at_the_opposite_side():
    target = TileTarget(SIDE, PATCH)
    assert np.array_equal(target.in_order(), np.arange(SIDE**2)) and target.count == SIDE**2
    for texel in (0, 5 * SIDE + 63, 40 * SIDE + 40):
        texels, place, _ = target.around(texel)
        assert texel in texels and len(np.unique(texels)) == PATCH**2
        row, column = np.divmod(texels, SIDE)
        origin = np.array(divmod(texel, SIDE)) - PATCH // 2
        assert np.array_equal((origin[0] + place[:, 1]) % SIDE, row)
        assert np.array_equal((origin[1] + place[:, 0]) % SIDE, column)
    values = np.arange(SIDE**2)
    assert np.array_equal(target.map(values).ravel(), values)


def test_strands_on_a_tile_go_on_at_the_opposite_side():
    """Whose number across it is whole, from patches that begin anywhere between two."""
    period = 8
    shift = np.random.default_rng(0).uniform(0, period, (200, 1, 1))
    wave = 2 * np.pi * (np.arange(PATCH)[:, None] + np.zeros(PATCH) + shift) / period
    source = ArraySource(np.stack([np.sin(wave), np.cos(wave)], -1).astype(np.float32), shift[:, 0], 1.0)
    quilt = quilt_on(source, TileTarget(SIDE, PATCH), np.random.default_rng(0))
    assert (quilt.patch >= 0).all()
    steps = np.abs(np.diff(quilt.features, axis=0)).mean()
    across = np.abs(quilt.features[0] - quilt.features[-1]).mean()
    assert across < 1.3 * steps
