"""Pictures of meshes whose vertices move."""

import numpy as np
import pytest
import torch

from mitex.mesh import icosphere
from mitex.methods.neural_style.figure import Figure, smooth_normals
from mitex.scenes.cameras import orbit
from mitex.scenes.shaded import GREY

CAMERAS = orbit(2, distance=2.5, resolution=24, start=90)


@pytest.fixture(scope="module")
def scene():
    ball = icosphere(8)
    return Figure(ball), torch.tensor(ball.vertices), torch.full(ball.vertices.shape, 0.8)


def test_normals_are_those_of_the_mesh():
    mesh = icosphere(6)
    moved = mesh.with_vertices(mesh.vertices * np.array([1.0, 0.5, 2.0], np.float32))
    normals = smooth_normals(torch.tensor(moved.vertices), torch.tensor(mesh.faces, dtype=torch.int64))
    np.testing.assert_allclose(normals.numpy(), moved.normals, atol=1e-5)


def test_colours_are_shaded_and_the_grey_picture_has_none(scene):
    figure, vertices, colours = scene
    colours = colours.clone()
    colours[:, 1] = 0.2
    coloured, plain = figure.pictures(CAMERAS, vertices, colours)
    hit = (plain < 1).all(-1)
    assert torch.allclose(coloured[hit], plain[hit] / GREY * torch.tensor([0.8, 0.2, 0.8]), atol=1e-5)
    assert (coloured[~hit] == 1).all() and plain[hit].max() <= GREY and plain[hit].std() > 0.02


def test_what_is_seen_is_the_moved_surface(scene):
    """Outline and all: a ball of half the size covers a quarter of the pixels, or a little less."""
    figure, vertices, colours = scene
    areas = [(figure.pictures(CAMERAS, r * vertices, colours)[1] < 1).sum().item() for r in (1.0, 0.5, 1.0)]
    assert areas[0] == areas[2] and 0.15 < areas[1] / areas[0] < 0.27


def test_the_background():
    ball = icosphere(2)
    plain = Figure(ball, 0.25).pictures(CAMERAS, *2 * [torch.tensor(ball.vertices)])[1]
    assert (plain[:, 0, 0] == 0.25).all()


@pytest.mark.parametrize("which", [0, 1])
def test_gradients_by_finite_differences(scene, which, monkeypatch):
    """Of the shading, with what each pixel sees held: the outline has no derivative."""
    figure, vertices, colours = scene
    held = figure.stage.visibility(CAMERAS)
    monkeypatch.setattr(figure.stage, "visibility", lambda cameras: held)
    monkeypatch.setattr(figure.stage, "move", lambda vertices: None)
    generator = torch.Generator().manual_seed(1)
    weights = torch.rand(2, 24, 24, 3, generator=generator)
    way, tint = (torch.randn(vertices.shape, generator=generator) for _ in range(2))

    def total(scale):
        moved, tinted = vertices + scale * way, colours + scale * tint
        return (figure.pictures(CAMERAS, moved, tinted)[which] * weights).sum()

    (slope,) = torch.autograd.grad(total(scale := torch.zeros((), requires_grad=True)), scale)
    with torch.no_grad():
        difference = (total(1e-3) - total(-1e-3)) / 2e-3
    assert slope.item() == pytest.approx(difference.item(), rel=0.02)
