"""Distances between surfaces by samples."""

import numpy as np
import pytest
import torch

from mitex.losses.chamfer import Samples, chamfer, sample_surface
from mitex.mesh import grid, icosphere


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def test_samples_are_even_by_area():
    # A square of two triangles beside one of half the area.
    points = torch.tensor([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [3, 0, 0], [2, 1, 0]])
    faces = torch.tensor([[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    samples = sample_surface(points, faces, 30_000, seeded())
    right = samples.points[:, 0] > 1.5
    assert float(right.float().mean()) == pytest.approx(1 / 3, abs=0.01)
    square = samples.points[~right]
    assert torch.allclose(square.mean(0), torch.tensor([0.5, 0.5, 0.0]), atol=0.01)
    assert torch.allclose(square.var(0), torch.tensor([1 / 12, 1 / 12, 0.0]), atol=0.003)
    assert torch.equal(samples.normals, torch.tensor([0.0, 0, 1]).expand_as(samples.normals))


def test_nearest_by_brute_force():
    a = Samples(torch.randn(200, 3, generator=seeded(1)), torch.randn(200, 3, generator=seeded(2)))
    b = Samples(torch.randn(300, 3, generator=seeded(3)), torch.randn(300, 3, generator=seeded(4)))
    distances = torch.cdist(a.points, b.points)
    to, back = distances.argmin(1), distances.argmin(0)
    expected = (
        distances.min(1).values.mean(),
        distances.min(0).values.mean(),
        1 - (a.normals * b.normals[to]).sum(1).mean(),
        1 - (b.normals * a.normals[back]).sum(1).mean(),
    )
    for term, reference in zip(chamfer(a, b), expected, strict=True):
        assert float(term) == pytest.approx(float(reference), abs=1e-5)


def test_both_normal_terms_work():
    """Turning one surface inside out changes both by 2: neither is stuck at its best value."""
    mesh = icosphere(8)
    points, faces = torch.tensor(mesh.vertices), torch.from_numpy(mesh.faces).long()
    theirs = sample_surface(points, faces, 4_000, seeded(1))
    ours = sample_surface(points, faces, 4_000, seeded(2))
    turned = sample_surface(points, faces.flip(1), 4_000, seeded(2))
    for same, other in zip(chamfer(ours, theirs)[2:], chamfer(turned, theirs)[2:], strict=True):
        assert 0 <= float(same) < 0.02 and 1.98 < float(other) <= 2


def test_two_parallel_squares():
    mesh = grid(4, 4)
    points, faces = torch.tensor(mesh.vertices), torch.from_numpy(mesh.faces).long()
    lower = sample_surface(points, faces, 20_000, seeded(1))
    upper = sample_surface(points + torch.tensor([0.0, 0, 0.5]), faces, 20_000, seeded(2))
    to, back, normals, _ = chamfer(lower, upper)
    assert float(to) == pytest.approx(0.5, abs=2e-3) and float(back) == pytest.approx(0.5, abs=2e-3)
    assert float(normals) == pytest.approx(0, abs=1e-6)


def test_gradients_by_finite_differences():
    mesh = icosphere(2)
    faces = torch.tensor(mesh.faces).long()
    target = sample_surface(torch.tensor(mesh.vertices).double() * 1.2, faces, 400, seeded(1))
    start = torch.from_numpy(mesh.vertices + np.random.default_rng(0).normal(0, 0.05, mesh.vertices.shape))

    def distance(points: torch.Tensor) -> torch.Tensor:
        return torch.stack(chamfer(sample_surface(points, faces, 300, seeded(5)), target)).sum()

    points = start.clone().requires_grad_()
    (gradient,) = torch.autograd.grad(distance(points), points)
    for vertex, axis in ((0, 0), (5, 1), (20, 2)):
        moved = []
        for sign in (1, -1):
            shifted = start.clone()
            shifted[vertex, axis] += sign * 1e-6
            moved.append(float(distance(shifted)))
        assert float(gradient[vertex, axis]) == pytest.approx((moved[0] - moved[1]) / 2e-6, abs=2e-4)
