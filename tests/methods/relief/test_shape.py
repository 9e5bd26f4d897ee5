"""Vertices that take their neighbours along."""

import numpy as np
import pytest
import torch

from mitex.mesh import icosphere
from mitex.methods.relief.shape import Shape

BALL = icosphere(6)
HEIGHTS = np.random.default_rng(0).standard_normal(len(BALL.vertices))


@pytest.mark.parametrize("smoothing", [0.0, 16.0])
def test_heights_come_back(smoothing):
    shape = Shape(BALL, smoothing, 1.0)
    offsets = shape.offsets(shape.coordinates(HEIGHTS))
    np.testing.assert_allclose(offsets, HEIGHTS[:, None] * BALL.normals, atol=1e-4)
    np.testing.assert_allclose(shape.heights(offsets)[:, 0], HEIGHTS, atol=1e-4)
    np.testing.assert_allclose(shape.moved(offsets), BALL.vertices + offsets.numpy(), atol=1e-6)


def pushed(smoothing: float) -> np.ndarray:
    """How far each vertex moves if one of them, the first, is pushed."""
    shape = Shape(BALL, smoothing, 1.0)
    push = torch.zeros(len(BALL.vertices), 3)
    push[0, 0] = 1
    return shape.offsets(push)[:, 0].numpy()


def test_the_smoother_the_further_vertices_are_taken_along():
    """As the dense inverse says, and all of the push is passed on."""
    alone, near, far = (pushed(smoothing) for smoothing in (0.0, 1.0, 16.0))
    assert alone[0] == 1 and not alone[1:].any()
    assert 1 > near[0] > far[0] > 0 and (far > 0).all()
    edges = BALL.edges
    laplacian = np.diag(edges.valence.astype(float))
    laplacian[edges.rows, edges.indices] = -1
    np.testing.assert_allclose(far, np.linalg.inv(np.eye(len(far)) + 16 * laplacian)[0], atol=1e-6)
    assert far.sum() == pytest.approx(1, abs=1e-5)


def test_sideways_offsets_are_scaled():
    push = torch.randn(len(BALL.vertices), 3, generator=torch.Generator().manual_seed(1))
    free, half, none = (Shape(BALL, 4.0, sideways) for sideways in (1.0, 0.5, 0.0))
    upward = free.heights(free.offsets(push)) * free.normals
    assert torch.allclose(none.offsets(push), upward, atol=1e-6)
    assert torch.allclose(half.offsets(push), 0.5 * (upward + free.offsets(push)), atol=1e-6)


def test_gradients_by_finite_differences():
    shape = Shape(BALL, 3.0, 0.5)
    generator = torch.Generator().manual_seed(2)
    place, way, weights = (torch.randn(len(BALL.vertices), 3, generator=generator) for _ in range(3))
    place.requires_grad_()
    (weights * shape.offsets(place)).sum().backward()
    assert place.grad is not None
    with torch.no_grad():
        change = (weights.double() * (shape.offsets(place + way) - shape.offsets(place - way))).sum() / 2
    assert (place.grad * way).sum().item() == pytest.approx(change.item(), rel=1e-3)
