"""Hash grids by both of their ways against one by loops in torch."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from benchmarks import torch_field
from mitex.bridge import call
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field.encoding import Encoding
from mitex.methods.nerf.field.hash_grid import HashGrid
from mitex.methods.nerf.field.tensors import channels, stack_rows
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

init()

CONFIG = NerfConfig(table=10, coarsest=8, finest=16)  # the first level is dense, the others are hashed


def uniform(*shape: int, seed: int = 0) -> torch.Tensor:
    return torch.empty(shape).uniform_(-0.99, 0.99, generator=torch.Generator().manual_seed(seed))


def features(grid: HashGrid, points: torch.Tensor, table: torch.Tensor) -> torch.Tensor:
    """(C, N) of points (N, 3)."""
    return call(lambda p, t: stack_rows(grid(dr.unravel(mi.Point3f, p.array), t.array)), points, table)


@pytest.fixture
def encoding() -> Encoding:
    return Encoding(CONFIG)


@pytest.mark.parametrize("trained", [False, True])
@pytest.mark.parametrize("which", [0, 1])
def test_features_are_those_of_loops(encoding, which, trained):
    points, table = uniform(200, 3), uniform(encoding.sizes[which], seed=1)
    expected = torch_field.encoded(encoding, which, points, table)
    actual = features(encoding.grids[which], points, table.requires_grad_(trained))
    np.testing.assert_allclose(actual.detach().T, expected, atol=2e-4)


def test_some_levels_of_that_are_dense_and_some_are_hashed(encoding):
    sizes = [part.stop - part.start for part in encoding.levels(0)]
    assert sizes[0] == 2 * 8**3 and sizes[-1] == 2 * 2**10


@pytest.mark.parametrize("moving", [False, True])
def test_gradients_are_those_of_loops(encoding, moving):
    share = uniform(200, 16, seed=2)
    ours, theirs = (
        (uniform(200, 3).requires_grad_(moving), uniform(encoding.sizes[0], seed=1).requires_grad_())
        for _ in range(2)
    )
    (features(encoding.grids[0], *ours) * share.T).sum().backward()
    (torch_field.encoded(encoding, 0, *theirs) * share).sum().backward()
    for a, b in zip(ours, theirs, strict=True):
        assert (a.grad is None) == (b.grad is None)
        if a.grad is not None and b.grad is not None:
            np.testing.assert_allclose(a.grad, b.grad, rtol=1e-3, atol=1e-3 * float(b.grad.abs().max()))


@pytest.mark.parametrize("trained", [False, True])
def test_points_beyond_the_cube_get_features_of_its_border(encoding, trained):
    table = uniform(encoding.sizes[0]).requires_grad_(trained)
    far, near = (features(encoding.grids[0], torch.tensor([[x, 0.2, 0.3]]), table) for x in (3.0, 1.0))
    torch.testing.assert_close(far, near, rtol=0, atol=0)


def test_a_grid_keeps_nothing_of_a_table():
    grid = HashGrid(2, 4, 8, 10)
    grid(channels(mi.Point3f, np.zeros((1, 3))), upload(mi.Float, np.zeros(grid.size, np.float32)))
    assert grid._grid.data is None
