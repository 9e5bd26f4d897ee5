"""Quilting from vertices to vertices: what a patch covers of a mesh, and what it shows."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.mesh import Mesh, grid, icosphere
from mitex.quilting.surface import quilt_on
from mitex.quilting.vertices import VertexTarget, vertex_patches

SIDE, PATCH, GAP = 40, 8, 0.05  # the square [-1, 1]^2 has vertices 0.05 apart
SQUARE = grid(SIDE, SIDE)
MIDDLE = SIDE // 2 * (SIDE + 2)


def test_a_patch_covers_the_vertices_that_lie_in_it():
    target = VertexTarget(SQUARE, PATCH, GAP)
    vertices, place, angle = target.around(MIDDLE)
    offset = (SQUARE.vertices[vertices] - SQUARE.vertices[MIDDLE])[:, :2] / GAP
    # Right points along x on what faces +z; rows go down.
    np.testing.assert_allclose((place - 0.5 * (PATCH - 1)) * [1, -1], offset, atol=1e-4)
    inside = (np.abs(SQUARE.vertices - SQUARE.vertices[MIDDLE]) < (0.5 * PATCH - 0.25) * GAP).all(1)
    assert set(np.flatnonzero(inside)) <= set(vertices) and len(vertices) <= (PATCH + 1) ** 2
    assert np.allclose(angle, 0, atol=1e-4)
    assert target.area == pytest.approx(4 / (GAP**2 * len(SQUARE.vertices)))


def test_order_begins_at_one_place_and_ends_far_from_it():
    order = VertexTarget(SQUARE, PATCH, GAP).in_order()
    away = np.linalg.norm(SQUARE.vertices[order] - SQUARE.vertices[order[0]], axis=1)
    assert np.array_equal(np.sort(order), np.arange(len(SQUARE.vertices)))
    assert np.corrcoef(away, np.arange(len(away)))[0, 1] > 0.9


def test_vertices_without_faces_get_zeros():
    loose = Mesh(np.concatenate([[[9, 9, 9]], SQUARE.vertices]), SQUARE.faces + 1)
    target, plain = (VertexTarget(mesh, PATCH, GAP) for mesh in (loose, SQUARE))
    assert target.count == plain.count
    assert all(map(np.array_equal, target.around(MIDDLE), plain.around(MIDDLE)))
    values = np.arange(target.count) + 1.0
    assert target.map(values).tolist() == [0, *values]


def test_patches_show_what_is_around_their_middle_turned():
    """A linear function, which interpolation keeps: its slope turns with the patch."""
    values = SQUARE.vertices[:, :2] @ [[1.0], [2.0]] / GAP
    source = vertex_patches(SQUARE, values, PATCH, GAP, 30, 4, np.random.default_rng(0))
    assert source.length == PATCH and len(source.values) % 4 == 0 and 60 < len(source.values) <= 120
    centre = source.centres[:, :2] * GAP
    assert (np.abs(centre) < 1 - 0.5 * PATCH * GAP).all()  # none reaches past the border
    np.testing.assert_allclose(source.values.mean((1, 2, 3)), (centre @ [1, 2]) / GAP, atol=1e-3, rtol=1e-4)
    down, across = (np.diff(source.values[..., 0], axis=k).mean((1, 2)) for k in (1, 2))
    slope = across - 1j * down  # up is against the rows
    np.testing.assert_allclose(np.abs(slope), np.hypot(1, 2), rtol=1e-3)
    turns = np.angle(slope.reshape(-1, 4)[:, 1:] / slope.reshape(-1, 4)[:, :1]) % (2 * np.pi)
    np.testing.assert_allclose(turns, np.tile(0.5 * np.pi * np.arange(1, 4), (len(turns), 1)), rtol=1e-3)


@pytest.mark.parametrize(("right", "slope"), [((1, 0, 0), 1 + 2j), ((0, 1, 0), 2 - 1j)], ids=["x", "y"])
def test_patches_lie_as_directions_say(right, slope):
    values = SQUARE.vertices[:, :2] @ [[1.0], [2.0]] / GAP
    directions = np.tile(np.array(right, float), (len(SQUARE.vertices), 1))
    for turns in (1, 2):
        source = vertex_patches(SQUARE, values, PATCH, GAP, 30, turns, np.random.default_rng(0), directions)
        down, across = (np.diff(source.values[..., 0], axis=k).mean((1, 2)) for k in (1, 2))
        np.testing.assert_allclose((across - 1j * down)[::turns], slope, rtol=1e-3)
        np.testing.assert_allclose(
            (across - 1j * down)[turns - 1 :: turns], slope * (-1) ** (turns - 1), rtol=1e-3
        )


def test_a_patch_covers_what_directions_say():
    directions = np.tile([0.0, 1.0, 0.0], (len(SQUARE.vertices), 1))
    vertices, place, _ = VertexTarget(SQUARE, PATCH, GAP, directions).around(MIDDLE)
    offset = (SQUARE.vertices[vertices] - SQUARE.vertices[MIDDLE])[:, :2] / GAP
    expected = np.stack([offset[:, 1], offset[:, 0]], axis=1)  # right is y, down is x
    np.testing.assert_allclose(place - 0.5 * (PATCH - 1), expected, atol=1e-4)


def test_chance_decides_on_places_and_angles():
    def patches(seed: int) -> np.ndarray:
        return vertex_patches(SQUARE, SQUARE.vertices, PATCH, GAP, 5, 2, np.random.default_rng(seed)).values

    assert np.array_equal(patches(0), patches(0))
    assert patches(0).shape != patches(1).shape or not np.allclose(patches(0), patches(1))


def test_no_patch_fits_on_a_mesh_that_is_smaller():
    square = grid(10, 10)
    small = replace(square, vertices=0.1 * square.vertices)
    source = vertex_patches(small, small.vertices, PATCH, GAP, 50, 4, np.random.default_rng(0))
    assert source.values.shape == (0, PATCH, PATCH, 3) and source.centres.shape == (0, 3)


def test_stripes_of_one_mesh_are_stripes_on_another():
    """As wide, though the other one is curved; along no more than a few edges they are straight."""
    waves = np.sin(2 * np.pi * SQUARE.vertices[:, :1] / (8 * GAP))
    ball = icosphere(20)
    edge = float(ball.edge_lengths.mean())
    source = vertex_patches(SQUARE, waves, 16, GAP, 300, 8, np.random.default_rng(0))
    quilt = quilt_on(source, VertexTarget(ball, 16, edge), np.random.default_rng(0))
    values = quilt.features[:, 0]
    i, j = ball.edges.rows, ball.edges.indices
    slope = np.square(values[i] - values[j]).mean() / edge**2 / values.var()
    # Half of the square of the gradient of a wave is along any direction.
    assert slope == pytest.approx(0.5 * (2 * np.pi / (8 * edge)) ** 2, rel=0.2)
    assert values.std() > 0.8 * np.sqrt(0.5)
