"""Sparse products and lookups against dense ones, with their gradients."""

import numpy as np
import pytest
import scipy.sparse
import torch

from mitex.sparse import LinearMap, Weights


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(2)


def _gradcheck(function, dense, count, generator):
    """Values and gradients of a linear function of rows (count, 3) are those of a dense matrix."""
    rows = torch.randn(count, 3, generator=generator, requires_grad=True)
    result = function(rows)
    assert torch.allclose(result, dense @ rows, atol=1e-5)
    upstream = torch.randn(result.shape, generator=generator)
    (gradient,) = torch.autograd.grad(result, rows, upstream)
    assert torch.allclose(gradient, dense.T @ upstream, atol=1e-5)


@pytest.mark.parametrize("kind", ["csr", "csc", "coo"])
def test_linear_map(generator, rng, kind):
    """Of any scipy matrix, also one with empty rows and columns."""
    dense = rng.normal(size=(9, 6)) * (rng.random((9, 6)) < 0.3)
    dense[4], dense[:, 2] = 0, 0
    matrix = LinearMap(scipy.sparse.csr_array(dense).asformat(kind))
    _gradcheck(matrix, torch.from_numpy(dense).float(), 6, generator)


def test_a_linear_map_stays_exact_under_autocast(rng):
    matrix, rows = rng.random((4, 3)), torch.from_numpy(rng.random((3, 2)).astype(np.float32))
    with torch.autocast("cpu", torch.bfloat16):
        result = LinearMap(scipy.sparse.csr_array(matrix))(rows)
    np.testing.assert_allclose(result.numpy(), matrix @ rows.numpy(), rtol=1e-5)


def test_a_linear_map_takes_rows_in_any_order_in_memory(generator, rng):
    dense = rng.normal(size=(5, 4)).astype(np.float32)
    columns = torch.randn(3, 4, generator=generator)
    result = LinearMap(scipy.sparse.csr_array(dense))(columns.T)
    assert torch.allclose(result, torch.from_numpy(dense) @ columns.T, atol=1e-6)


def _weights(generator, points=40, count=4, columns=11):
    index = torch.randint(columns, (points, count), generator=generator, dtype=torch.int32)
    weight = torch.randn(points, count, generator=generator)
    dense = torch.zeros(points, columns)
    for p in range(points):
        for i, w in zip(index[p].tolist(), weight[p].tolist(), strict=True):
            dense[p, i] += w  # a row may be read twice
    return Weights(index, weight, columns), dense


def test_weights(generator):
    weights, dense = _weights(generator)
    assert torch.allclose(weights.matrix.to_dense(), dense, atol=1e-6)
    _gradcheck(weights, dense, 11, generator)


def test_weights_of_one_point_and_one_row(generator):
    weights = Weights(torch.tensor([[2]], dtype=torch.int32), torch.tensor([[-3.0]]), 5)
    table = torch.arange(10.0).view(5, 2)
    assert weights(table).tolist() == [[-12, -15]]
    assert weights.transposed(torch.ones(1, 2)).sum(0).tolist() == [-3, -3]


def test_no_points_read_nothing(generator):
    weights = Weights(torch.empty(0, 3, dtype=torch.int32), torch.empty(0, 3), 5)
    table = torch.randn(5, 2, generator=generator, requires_grad=True)
    result = weights(table)
    assert result.shape == (0, 2)
    result.sum().backward()
    assert table.grad is not None and not table.grad.any()


def test_the_gradient_may_be_an_expanded_tensor(generator):
    """As `sum` gives it."""
    weights, dense = _weights(generator)
    table = torch.randn(11, 3, generator=generator, requires_grad=True)
    weights(table).sum().backward()
    assert table.grad is not None
    assert torch.allclose(table.grad, dense.sum(0)[:, None].expand(11, 3), atol=1e-5)


def test_on_another_device_rows_are_added_one_by_one(generator, monkeypatch):
    """The way of devices other than a CPU, on this one."""
    weights, dense = _weights(generator)
    upstream = torch.randn(40, 3, generator=generator)

    class Elsewhere(torch.Tensor):
        device = torch.device("meta")

    elsewhere = upstream.as_subclass(Elsewhere)
    result = weights.transposed(elsewhere).as_subclass(torch.Tensor)
    assert torch.allclose(result, dense.T @ upstream, atol=1e-5)
