"""Settings of a fit that say what a step compares: an ignored one fails here."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.config import PRESETS
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.training.task import TextureTask
from mitex.runtime import init, threads
from mitex.training.config import resolve
from tests.methods.nerf.tiny import tiny_capture

init()
SMALL = ["rays=256", "table=12", "coarsest=8", "finest=16", "occupancy=32", "ray_steps=96"]
SETTINGS = [*SMALL, "clustering=1", "normals=1"]


def first_step(*settings: str) -> np.ndarray:
    """The loss, and how large its gradients are."""
    threads(1)
    ball = icosphere(12)
    base = Mesh(0.55 * ball.vertices, ball.faces, name="ball")
    config, capture = resolve(PRESETS, overrides=[*SETTINGS, *settings]), tiny_capture()
    task = TextureTask(config, capture, (capture, 0), Projection(base, reach=0.12), face_frames(base), 0.12)
    generator = torch.Generator().manual_seed(0)
    task.begin(0, generator)
    loss = task.loss(0, generator).value
    loss.backward()
    gradients = [v.grad.norm().item() for v in task.named.values() if v.grad is not None]
    return np.array([loss.item(), *gradients])


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    return first_step()


@pytest.mark.parametrize(
    "change",
    [
        "one_view=true",
        "rays_across=2",
        "colour_loss=l2",
        "cluster_entries=16",
        "normal_rays=0.5",
        "detach_normals=true",
        "fresnel=false",
    ],
)
def test_a_setting_changes_the_first_step(plain, change):
    changed = first_step(change)
    assert np.isfinite(changed).all()
    assert len(changed) != len(plain) or not np.allclose(changed, plain, rtol=1e-3, atol=0)


def test_the_same_settings_make_the_same_step(plain):
    np.testing.assert_allclose(first_step(), plain, rtol=1e-4)
