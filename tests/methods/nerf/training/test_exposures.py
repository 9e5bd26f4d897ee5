"""Photos of differing brightness, whose gains are learned with the field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.colour import linear_to_srgb, srgb_to_linear
from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.config import PRESETS
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.training.radiance import BETAS, EPSILON
from mitex.methods.nerf.training.task import TextureTask
from mitex.runtime import init, threads
from mitex.training.config import resolve
from tests.methods.nerf.tiny import tiny_capture

init()
VIEWS = len(tiny_capture())
GAINS = np.random.default_rng(4).uniform(-0.6, 0.1, VIEWS)  # logarithms, of linear light


def drifting() -> Capture:
    """The small capture with photos that were exposed by `GAINS`."""
    images = []
    for image, gain in zip(tiny_capture().images, GAINS, strict=True):
        colour = linear_to_srgb(np.exp(gain) * srgb_to_linear(image[..., :3] / 255.0))
        images.append(np.concatenate([np.round(255.0 * np.clip(colour, 0, 1)), image[..., 3:]], 2))
    return replace(tiny_capture(), images=tuple(image.astype(np.uint8) for image in images))


def small_task(exposures: bool) -> TextureTask:
    """A field at its start, the first refresh of its occupancy done."""
    threads(1)
    small = ["rays=256", "table=12", "coarsest=8", "finest=16", "occupancy=32", "ray_steps=96"]
    config = resolve(PRESETS, overrides=[*small, f"exposures={str(exposures).lower()}"])
    ball = icosphere(12)
    base = Mesh(0.55 * ball.vertices, ball.faces, name="ball")
    capture = drifting()
    task = TextureTask(config, capture, (capture, 0), Projection(base, reach=0.12), face_frames(base), 0.12)
    task.begin(0, torch.Generator().manual_seed(0))
    return task


def loss(task: TextureTask) -> torch.Tensor:
    """Of the same rays each time."""
    return task.loss(0, torch.Generator().manual_seed(0)).value


def test_without_gains_the_loss_is_that_of_equal_ones():
    off, on = small_task(False), small_task(True)
    assert "exposures" not in off.named
    # The first light is estimated without gains, or with them.
    assert (on.named["light"] - off.named["light"]).abs().max() > 1e-3
    on.named["light"].copy_(off.named["light"])
    assert loss(on).item() == pytest.approx(loss(off).item(), rel=1e-5)


def test_all_photos_brighter_alike_change_nothing():
    task = small_task(True)
    with torch.no_grad():
        task.named["exposures"].copy_(torch.from_numpy(GAINS))
        before = loss(task).item()
        task.named["exposures"].add_(0.7)
    assert loss(task).item() == pytest.approx(before, rel=1e-5)


def test_gains_get_the_gradient_of_the_loss():
    task = small_task(True)
    gains = task.named["exposures"]
    with torch.no_grad():
        gains.copy_(torch.from_numpy(GAINS))
    (gradient,) = torch.autograd.grad(loss(task), [gains])
    assert gradient.abs().max() > 1e-3 and abs(gradient.sum()) < 1e-4 * gradient.abs().sum()
    for direction in np.random.default_rng(0).normal(size=(3, VIEWS)):
        values = []
        for sign in (1.0, -1.0):
            with torch.no_grad():
                gains.copy_(torch.from_numpy(GAINS + sign * 0.001 * direction))
            values.append(loss(task).item())
        expected = float(gradient @ torch.from_numpy(direction).float())
        assert (values[0] - values[1]) / 0.002 == pytest.approx(expected, rel=0.01, abs=1e-5)


def test_gains_are_learned_with_the_field():
    errors = {}
    for exposures in (False, True):
        task, generator = small_task(exposures), torch.Generator().manual_seed(0)
        learned = [value for value in task.parameters if value.requires_grad]
        optimizer = torch.optim.Adam(learned, lr=1e-2, betas=BETAS, eps=EPSILON)
        colours = []
        for step in range(110):
            task.begin(step, generator)
            result = task.loss(step, generator)
            optimizer.zero_grad()
            result.value.backward()
            optimizer.step()
            colours.append(result.metrics["colour"])
        errors[exposures] = np.mean(colours[-15:])
        if exposures:
            gains = task.named["exposures"].detach().numpy()
            assert np.corrcoef(gains, GAINS)[0, 1] > 0.98
            off = gains - gains.mean() - (GAINS - GAINS.mean())
            assert np.abs(off).mean() < 0.2 * np.abs(GAINS - GAINS.mean()).mean()
    assert errors[True] < 0.9 * errors[False], errors
