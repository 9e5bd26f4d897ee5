"""Pictures of decoded states against the decoder at each pixel's own point."""

import numpy as np
import pytest
import torch

from mitex.mesh import icosphere
from mitex.methods.nca.decoder.surface import Points, Surface
from mitex.methods.nca.views import render_views
from mitex.scenes.cameras import Cameras, orbit
from mitex.scenes.stage import Stage
from tests.methods.nca import tiny


@pytest.fixture(scope="module")
def look():
    return tiny.texture(("albedo", "height")).look


@pytest.fixture(scope="module")
def sphere():
    return icosphere(4)


@pytest.fixture(scope="module")
def state(sphere):
    return torch.rand(len(sphere.vertices), 16, generator=torch.Generator().manual_seed(0)) - 0.5


def _render(look, sphere, state, cameras, antialias=1):
    surface = Surface(sphere, look.interpolation)
    return render_views(look.decoder, state, surface, Stage(sphere), cameras, antialias)


def test_pixels_are_the_decoder_where_they_see_the_mesh(look, sphere, state):
    cameras = orbit(2, distance=3.0, resolution=12)
    views = _render(look, sphere, state, cameras)
    assert views.shape == (2, 12, 12, 4)
    hits = Stage(sphere).hits(cameras)
    surface = Surface(sphere)
    expected = look.decoder(surface, surface.table(state), Points(hits.face, hits.barycentric))
    assert 0.2 < hits.hit.float().mean() < 0.8
    assert torch.allclose(views.view(-1, 4)[hits.hit], expected, atol=1e-6)
    assert not views.view(-1, 4)[~hits.hit].any()


def test_antialiased_pixels_are_means(look, sphere, state):
    """Of a picture n times as fine; nothing counts as 0."""
    coarse, fine = (orbit(1, distance=3.0, resolution=r) for r in (8, 24))
    mean = _render(look, sphere, state, fine)[0].view(8, 3, 8, 3, 4).mean((1, 3))
    assert torch.allclose(_render(look, sphere, state, coarse, 3)[0], mean, atol=1e-4)


def test_gradients_reach_what_is_seen(look, sphere, state):
    own = state.clone().requires_grad_()
    cameras = orbit(1, distance=3.0, resolution=16)
    _render(look, sphere, own, cameras).sum().backward()
    front, back = (np.argmax(sign * sphere.vertices @ cameras.origin[0]) for sign in (1, -1))
    assert own.grad[front].abs().max() > 0 and not own.grad[back].any()
    assert all(p.grad is not None and p.grad.any() for p in look.decoder.parameters())


def test_a_camera_that_sees_nothing(look, sphere, state):
    origin, target, up = np.array([[0, 0, 3.0], [0, 0, 9.0], [0, 1.0, 0]])
    away = Cameras("perspective", origin, target, up, fov=30, width=6, height=4)
    views = _render(look, sphere, state, away)
    assert views.shape == (1, 4, 6, 4) and not views.any()
