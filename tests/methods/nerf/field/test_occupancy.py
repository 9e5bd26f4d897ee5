"""Which cells are skipped."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mitex.methods.nerf.field.occupancy import (
    WARMUP,
    Occupancy,
    hull_cells,
    packed_cells,
    sample_grid,
    unpacked_cells,
)
from tests.methods.nerf.tiny import tiny_capture


def ball(points: np.ndarray) -> np.ndarray:
    return np.where(np.linalg.norm(points, axis=1) < 0.5, 50.0, 0.0).astype(np.float32)


def centres(side: int) -> np.ndarray:
    axis = (np.arange(side) + 0.5) * (2 / side) - 1
    return np.linalg.norm(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1), axis=-1)


def test_cells_with_matter_are_found_and_others_are_not():
    grid = Occupancy(16)
    generator = torch.Generator().manual_seed(0)
    assert grid.occupied.all() and grid.share == 1
    for _ in range(3):
        grid.refresh(ball, generator)
    distance = centres(16)
    assert grid.occupied[distance < 0.4].all() and not grid.occupied[distance > 0.62].any()


def test_what_goes_away_is_forgotten_slowly_and_what_comes_is_seen():
    grid = Occupancy(8)
    generator = torch.Generator().manual_seed(0)
    grid.refresh(ball, generator)
    before = grid.occupied.sum()
    for _ in range(WARMUP + 60):
        grid.refresh(lambda p: np.zeros(len(p), np.float32), generator)
    assert grid.values.max() < 50 * 0.95 ** (WARMUP + 50) * 1.1 and before > 0
    for _ in range(40):  # of half the cells each
        grid.refresh(ball, generator)
    assert grid.occupied[centres(8) < 0.3].all()


def test_impossible_cells_are_never_looked_at():
    possible = np.zeros((8, 8, 8), bool)
    possible[:4] = True
    points = []
    grid = Occupancy(8, possible)
    grid.refresh(lambda p: points.append(p) or ball(p), torch.Generator())
    assert (np.concatenate(points)[:, 0] < 0).all() and not grid.occupied[4:].any()


def test_the_state_goes_round_and_must_fit():
    grid, other = Occupancy(8), Occupancy(8)
    grid.refresh(ball, torch.Generator().manual_seed(0))
    other.load_state(grid.state())
    np.testing.assert_array_equal(other.occupied, grid.occupied)
    with pytest.raises(ValueError):
        Occupancy(4).load_state(grid.state())


def test_a_grid_is_the_density_where_cells_are_occupied():
    occupied = np.zeros((4, 4, 4), bool)
    occupied[1:3, 1:3, 2] = True
    density = sample_grid(lambda p: p @ np.array([1, 10, 100], np.float32) + 200, occupied, 8)
    axis = (np.arange(8) + 0.5) / 4 - 1
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    inside = occupied.repeat(2, 0).repeat(2, 1).repeat(2, 2)
    np.testing.assert_allclose(density, np.where(inside, x + 10 * y + 100 * z + 200, 0), rtol=1e-5)


def test_hull_cells_hold_the_object_and_little_else():
    cells = hull_cells(tiny_capture(), 32)
    distance = centres(32)
    assert cells[distance < 0.55].all() and not cells[distance > 0.9].any()


@pytest.mark.parametrize("side", [1, 3, 8])
def test_packed_cells_come_back(side):
    occupied = np.random.default_rng(0).integers(0, 2, (side,) * 3).astype(np.uint8)
    assert np.array_equal(unpacked_cells(packed_cells(occupied), side), occupied)


def test_packed_cells_of_another_grid_are_refused():
    for side in (7, 9):
        with pytest.raises(ValueError, match="another grid"):
            unpacked_cells(packed_cells(np.ones((8, 8, 8), np.uint8)), side)
