"""Settings of a fit that say what a step compares: an ignored one fails here."""

from __future__ import annotations

from dataclasses import fields
from unittest.mock import MagicMock

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import fit
from mitex.methods.nerf.base import coarse
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.base.coarse import BaseShape
from mitex.methods.nerf.config import PRESETS, NerfConfig, RadianceConfig
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.training.plain import PlainTask
from mitex.methods.nerf.training.radiance import REFRESH, schedule
from mitex.methods.nerf.training.task import TextureTask
from mitex.runtime import init, threads
from mitex.training.config import resolve
from tests.methods.fits import small_coarse_fields
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
        "colour_loss=l2",
        "cluster_entries=16",
        "normal_rays=0.5",
        "detach_normals=true",
        "fresnel=false",
        "clustering=0",
        "distortion=0",
        "normals=0",
        "exposures=true",
        "learn_light=true",
        "ray_steps=48",
        "rays=64",
        "table=9",
        "coarsest=12",
        "finest=12",
        "density_width=16",
        "occupancy=16",
        "seed=1",
    ],
)
def test_a_setting_changes_the_first_step(plain, change):
    changed = first_step(change)
    assert np.isfinite(changed).all()
    assert len(changed) != len(plain) or not np.allclose(changed, plain, rtol=1e-3, atol=0)


def test_the_same_settings_make_the_same_step(plain):
    np.testing.assert_allclose(first_step(), plain, rtol=1e-4)


class TestOtherSettings:
    def test_the_projection_is_that_of_the_settings(self, monkeypatch):
        """Of the field and of the base shape, whose concavity is one too."""
        given = []

        class Stop(Exception):
            pass

        def projection(mesh, **options):
            given.append(options)
            raise Stop

        small_coarse_fields(monkeypatch)
        base = icosphere(44)  # even enough not to be remeshed
        settings = ["base_steps=2", "neighbours=5", "repulsion=0.2", "concavity=0.4"]
        monkeypatch.setattr("mitex.methods.nerf.base.coarse.Projection", projection)
        with pytest.raises(Stop):
            fit(tiny_capture(), base_mesh=Mesh(0.55 * base.vertices, base.faces), set=settings)
        shape = BaseShape(base, base.vertices, 0.1)
        monkeypatch.setattr("mitex.methods.nerf.fitting.find_base", lambda *_, **__: shape)
        monkeypatch.setattr("mitex.methods.nerf.fitting.Projection", projection)
        with pytest.raises(Stop):
            fit(tiny_capture(), set=settings)
        assert [(one["neighbours"], one["repulsion"]) for one in given] == [(5, 0.2)] * 2

    def test_the_base_shape_is_cut_out_by_its_concavity(self, monkeypatch):
        cut = []
        monkeypatch.setattr(coarse, "sample_grid", lambda *_: None)
        monkeypatch.setattr(coarse, "base_shape", lambda _, concavity: cut.append(concavity))
        coarse._shape_of(MagicMock(), resolve(PRESETS, overrides=["concavity=0.4"]))
        assert cut == [0.4]

    def test_the_coarse_field_is_trained_for_base_steps(self):
        config = coarse.coarse_config(resolve(PRESETS, overrides=["base_steps=77", "lr=0.02", "seed=3"]))
        assert (config.steps, config.lr_steps, config.lr, config.seed) == (77, 77, 0.02, 3)

    def test_the_learning_rate_falls_to_a_tenth_in_lr_steps(self):
        rate = schedule(resolve(PRESETS, overrides=["lr=0.02", "lr_steps=50"]))["lr"]
        assert [rate(step) for step in (0, 50, 100)] == pytest.approx([0.02, 0.002, 0.0002])

    @pytest.mark.parametrize("average", [0.0, 0.75])
    def test_the_mean_parameters_follow(self, average):
        """By a quarter of the way at 0.75, every `REFRESH` steps."""
        config = RadianceConfig(average=average, table=10, occupancy=16)
        task = PlainTask(config, tiny_capture(), (tiny_capture(), 0))
        before = {name: value.clone() for name, value in task.mean.items()}
        with torch.no_grad():
            for value in task.named.values():
                value += 1.0
        for _ in range(REFRESH - 1):
            task._average()
        assert all(torch.equal(task.mean[name], before[name]) for name in before)
        task._average()
        for name, value in task.mean.items():
            torch.testing.assert_close(value - before[name], torch.full_like(value, 1 - average))


class TestEmptySpace:
    """Rays that meet no occupied cell."""

    def test_nothing_is_learned_from_them(self, monkeypatch):
        config = RadianceConfig(rays=32, table=10, occupancy=16)
        task = PlainTask(config, tiny_capture(), (tiny_capture(), 0))
        monkeypatch.setattr("mitex.methods.nerf.training.radiance.march", lambda *_: ())
        step = task.loss(0, torch.Generator().manual_seed(0))
        step.value.backward()
        assert 0 < step.value.item() < 1 and step.metrics["samples"] == 0
        assert all(not value.grad.any() for value in task.named.values() if value.grad is not None)

    def test_a_field_that_is_empty_is_told(self, monkeypatch):
        config = RadianceConfig(rays=32, table=10, occupancy=16)
        task = PlainTask(config, tiny_capture(), (tiny_capture(), 0))
        monkeypatch.setattr("mitex.methods.nerf.training.radiance.march", lambda *_: ())
        monkeypatch.setattr(type(task.occupancy), "share", 0.0)
        with pytest.raises(ConfigError, match="the field has become empty; lower `lr`, and see that"):
            task.loss(0, torch.Generator().manual_seed(0))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"coarsest": 33, "finest": 32}, "finest = 32 is coarser than 33; raise finest"),
        ({"rays": 15, "rays_across": 4}, "rays = 15 are fewer than 4 x 4 of one pixel; raise rays"),
    ],
)
def test_settings_that_contradict(settings, message):
    with pytest.raises(ConfigError, match=message):
        NerfConfig(**settings)


def test_settings_that_just_fit():
    config = NerfConfig(coarsest=32, finest=32, rays=16, rays_across=4)
    assert (config.finest, config.rays) == (config.coarsest, config.rays_across**2)


TESTED_ELSEWHERE = {
    "preset": "tests/training",
    "steps": "tests/training",
    "checkpoint_every": "tests/training",
    "preview_every": "tests/training",
    "interior_weight": "tests/methods/nerf/test_fitting.py",
    "rays_across": "tests/methods/nerf/training/test_rays_across.py",
    "refine_cameras": "tests/methods/nerf/test_fitting.py",
    **dict.fromkeys(
        ("neighbours", "repulsion", "concavity", "base_steps", "lr", "lr_steps", "average"), __name__
    ),
}


def test_no_setting_is_forgotten():
    (cases,) = (mark.args[1] for mark in test_a_setting_changes_the_first_step.pytestmark)
    tested = {case.partition("=")[0] for case in cases} | TESTED_ELSEWHERE.keys()
    assert tested == {field.name for field in fields(NerfConfig)}
