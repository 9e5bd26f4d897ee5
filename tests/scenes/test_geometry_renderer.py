"""Derivatives of images with respect to vertices."""

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.scenes.cameras import orbit
from mitex.scenes.geometry_renderer import GeometryRenderer


@pytest.fixture(scope="module")
def renderer():
    return GeometryRenderer(icosphere(8), orbit(2, resolution=32), samples=1024, gradient_samples=256)


def weighted(images: torch.Tensor) -> torch.Tensor:
    """A number that depends on where in the pictures something is."""
    ramp = torch.linspace(0, 1, images.shape[2])
    return (images * ramp[:, None]).mean()


MOVES = {
    "larger": lambda v: v,
    "sideways": lambda v: torch.tensor([1.0, 0.0, 0.0]).expand_as(v),
    "taller": lambda v: v * torch.tensor([0.0, 1.0, 0.0]),
    "slanted": lambda v: torch.tensor([0.0, 0.0, 0.5]) * v[:, 1:2],
}


@pytest.fixture(scope="module")
def gradient(renderer) -> torch.Tensor:
    vertices = torch.tensor(icosphere(8).vertices, requires_grad=True)
    weighted(renderer.render(vertices, seed=3)).backward()
    assert vertices.grad is not None
    return vertices.grad


@pytest.mark.parametrize("name", MOVES)
def test_derivatives_by_finite_differences(renderer, gradient, name):
    start = torch.tensor(icosphere(8).vertices)
    way, step = MOVES[name](start), 0.03
    derivative = float((gradient * way).sum())
    values = [float(weighted(renderer.render(start + sign * step * way, seed=3))) for sign in (1, -1)]
    expected = (values[0] - values[1]) / (2 * step)
    assert abs(expected) > 5e-3
    assert derivative == pytest.approx(expected, rel=0.08)


def test_images_come_without_a_graph_too(renderer):
    images = renderer.render(torch.tensor(icosphere(8).vertices))
    assert images.shape == (2, 32, 32, 3) and not images.requires_grad
    assert float(images.min()) >= 0 and np.ptp(images.numpy()) > 0.1


@pytest.mark.parametrize("vertices", [torch.zeros(3, 3), torch.zeros(642, 3, dtype=torch.float64)])
def test_other_vertices_are_refused(renderer, vertices):
    with pytest.raises(ConfigError, match=r"float32 tensor of shape \(642, 3\)"):
        renderer.render(vertices)
