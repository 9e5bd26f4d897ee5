import pytest
import torch

from mitex.losses import laplacian_excess
from mitex.mesh import icosphere


@pytest.fixture(scope="module")
def edges():
    graph = icosphere(3).edges
    return torch.from_numpy(graph.rows.copy()), torch.from_numpy(graph.indices.copy())


def test_the_formula(edges):
    rows, neighbours = edges
    count = int(rows.max()) + 1
    values = torch.randn(count, generator=torch.Generator().manual_seed(0))
    sums = [0.0] * count
    for i, j in zip(rows.tolist(), neighbours.tolist(), strict=True):
        sums[i] += values[j].item() - values[i].item()
    mean = sum(map(abs, sums)) / count
    assert laplacian_excess(values, rows, neighbours, 0.3).item() == pytest.approx(mean - 0.3, rel=1e-5)
    assert laplacian_excess(values, rows, neighbours, 1.01 * mean).item() == 0


def test_the_sum_with_its_sign_would_be_zero(edges):
    rows, neighbours = edges
    values = torch.randn(int(rows.max()) + 1, dtype=torch.float64)
    assert (values[neighbours] - values[rows]).sum().abs() < 1e-9


def test_even_values_cost_nothing(edges):
    assert laplacian_excess(torch.full((92,), 3.0), *edges, tolerance=0.0).item() == 0


def test_its_gradient(edges):
    values = torch.randn(92, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    assert torch.autograd.gradcheck(
        lambda v: laplacian_excess(v, *edges, tolerance=0.1), values.requires_grad_()
    )
