"""Several rays through a pixel: their mean is compared with it, and is what a picture shows."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
import torch

from mitex.methods.nerf.capture.pixels import Pixels
from mitex.methods.nerf.config import RadianceConfig
from mitex.methods.nerf.field.rendering import render_rays, render_view, render_views
from mitex.methods.nerf.training.plain import PlainTask
from mitex.runtime import init
from tests.methods.nerf.tiny import tiny_capture

init()


def task(loss: Literal["l1", "l2"] = "l1") -> PlainTask:
    config = RadianceConfig(rays=64, rays_across=2, lr_steps=10, ray_steps=64, table=10, distortion=0.0)
    config = replace(config, occupancy=24, colour_loss=loss)
    return PlainTask(config, tiny_capture(), (tiny_capture(), 0))


@pytest.mark.parametrize("name", ["l1", "l2"])
def test_the_mean_of_rays_is_compared_with_their_pixel(name, monkeypatch):
    training, rays, pixels = task(name), [], []
    render, error = training.render, training.error

    def rendered(*arguments):
        rays.append(render(*arguments))
        rays.append((rays[0].colour.detach().clone(), rays[0].transmittance.detach().clone()))
        return rays[0]

    def compared(rendered, batch, background):
        pixels.append((rendered.colour, rendered.transmittance, batch, background))
        return error(rendered, batch, background)

    monkeypatch.setattr(training, "render", rendered)
    monkeypatch.setattr(training, "error", compared)
    loss = training.loss(5, torch.Generator().manual_seed(0)).value
    (colours, transmittances), (_, _, batch, background) = rays[1], pixels[0]
    assert colours.shape == (64, 3) and batch.colours.shape == (16, 3)
    means = [torch.stack(list(values.split(4))).mean(1) for values in (colours, transmittances)]
    assert means[1].std() > 0.01 and colours.view(16, 4, 3).std(1).max() > 1e-4
    shown = means[0] + means[1][:, None] * background
    photo = batch.colours * batch.alpha + background * (1 - batch.alpha)
    differences = (shown - photo).abs()
    torch.testing.assert_close(loss, differences.mean() if name == "l1" else 5 * (differences**2).mean())


def test_each_ray_has_a_pixel_at_first(monkeypatch):
    """Until the learning rate has gone half of its way."""
    training, batches = task(), []
    draw = training.pixels.draw
    monkeypatch.setattr(training.pixels, "draw", lambda *a: batches.append(draw(*a)) or batches[-1])
    for step in (0, 4, 5, 9):
        training.loss(step, torch.Generator().manual_seed(0))
    assert [(len(batch.view), len(batch.colours)) for batch in batches] == [(64, 64)] * 2 + [(64, 16)] * 2


def test_a_picture_shows_the_mean_of_rays():
    capture, field = tiny_capture(), task()
    trained = field.field(field.named)
    picture, photo = render_view(trained, capture, 1, across=3)
    batch, _ = Pixels(capture).image(1, 400, across=3)
    colour, transmittance = render_rays(trained, batch.origins, batch.directions)
    mean = (colour + transmittance[:, None]).reshape(*photo.shape[:2], 9, 3).mean(2)
    np.testing.assert_allclose(picture, np.clip(mean, 0, 1), atol=1e-6)
    single, _ = render_view(trained, capture, 1, across=1)
    assert np.abs(picture - single).max() > 1e-3
    np.testing.assert_allclose([*render_views(trained, capture, across=3)][1][0], picture, atol=1e-6)
