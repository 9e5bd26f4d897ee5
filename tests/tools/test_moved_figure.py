"""Pictures of a surface that its relief moves, and their derivatives."""

import sys
from importlib import import_module
from pathlib import Path

import pytest
import torch

from tests.methods.nca.text.tiny_text import grown, task

TOOLS = Path(__file__).parents[2] / "tools"
VIEWS = {
    "close-ups": ("views=patch", "density=4"),
    "whole": ("text_distances=2", "resolution=96"),
}
# Steps of finite differences, and how near they come: outlines advance from pixel to pixel.
EXACT = {"close-ups": (0.01, 0.005), "whole": (0.02, 0.07)}


@pytest.fixture(params=VIEWS)
def seen(request, monkeypatch):
    """Pictures by heights and colours, those of the bare figure without geometry, and places of vertices."""
    monkeypatch.syspath_prepend(str(TOOLS))
    monkeypatch.delitem(sys.modules, "moved_figure", raising=False)
    one = grown(task("frequency=8", *VIEWS[request.param]))
    (sphere,) = one.meshes
    figure = import_module("moved_figure").MovedFigure(sphere, one.config.text_relief)
    cameras = one.banks[sphere].sight(0).cameras
    points = torch.tensor(sphere.mesh.vertices)

    def pictures(height, colours):
        return figure.pictures(figure.moved(height), colours, cameras)

    return pictures, one.figures[sphere].bare(cameras), points, EXACT[request.param]


def test_an_even_relief_is_no_relief(seen):
    pictures, bare, points, _ = seen
    coloured, plain = pictures(torch.full((len(points),), 0.5), torch.full_like(points, 0.5))
    assert torch.allclose(plain, bare, atol=0.02) and torch.allclose(coloured, plain, atol=1e-6)


def test_derivatives_by_finite_differences(seen):
    """In heights, which also move outlines, and in colours."""
    pictures, bare, points, (step, near) = seen
    brighter = torch.linspace(-1, 1, bare.shape[2])[:, None].exp()  # to the right, so that places matter

    def value(height, colours):
        return torch.stack([(picture * brighter).mean() for picture in pictures(height, colours)]).sum()

    inputs = [0.5 + 0.1 * torch.sin(4 * points).prod(1), 0.5 + 0.4 * torch.sin(3 * points)]
    gradients = torch.autograd.grad(value(*(x.requires_grad_() for x in inputs)), inputs)
    height, colours = (x.detach() for x in inputs)
    for way in (torch.ones(len(points)), torch.sin(5 * points[:, 0] + 1)):
        ends = [value(height + sign * step * way, colours) for sign in (1, -1)]
        expected = float(ends[0] - ends[1]) / (2 * step)
        assert abs(expected) > 0.01 and float(gradients[0] @ way) == pytest.approx(expected, rel=near)
    way = torch.sin(2 * points)
    expected = float(value(height, colours + way / 8) - value(height, colours - way / 8)) * 4
    assert float((gradients[1] * way).sum()) == pytest.approx(expected, rel=1e-3)
