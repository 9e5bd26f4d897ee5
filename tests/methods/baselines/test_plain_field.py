"""The plain field: how many steps a time is enough for, that it sees held-out views, and what leaves it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
import torch

from mitex.asset import Asset
from mitex.errors import CheckpointError, ConfigError, MeshError
from mitex.evaluation.metrics import psnr
from mitex.mesh import icosphere
from mitex.methods import nerf
from mitex.methods.baselines.plain_field import PRESETS, PlainFieldConfig, PlainFieldTexture, fit, fitting
from mitex.methods.nerf.field.rendering import render_view
from mitex.methods.nerf.training.plain import PlainTask
from mitex.render import shell
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.training import checkpoint, run
from mitex.training.config import resolve
from tests.methods.nerf.tiny import tiny_capture

init()
SLOW, PACE = np.full(800, 0.2), np.full(200, 0.1)  # seconds of the steps of a probe
SMALL = ["rays=1024", "ray_steps=192", "table=13", "occupancy=48", "average=0.5", "preview_every=0"]
STEPS = 90


@pytest.mark.parametrize(
    ("seconds", "steps"),
    [
        (180.0 + 50.0, 1500),  # the first thousand take 180 s, then ten are made in a second
        (180.0, 1000),
        (100.0, 500),
        (1e-9, 1),
    ],
)
def test_steps_within_a_time(seconds, steps):
    clock = np.cumsum(np.concatenate([SLOW, PACE])).tolist()
    assert fitting.steps_within(seconds + 1e-3, clock) == pytest.approx(steps, abs=1)


def test_the_presets_are_those_of_the_texture():
    shared = [one.name for one in fields(PlainFieldConfig) if one.name != "seconds"]
    assert list(PRESETS) == list(nerf.PRESETS)
    for name, preset in PRESETS.items():
        assert all(getattr(preset, key) == getattr(nerf.PRESETS[name], key) for key in shared)
        assert preset.seconds == 0


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """A run for twelve seconds, which a probe of three steps took for those that 90 steps need."""
    folder = tmp_path_factory.mktemp("plain") / "run"
    calls = []

    def steps_within(seconds, clock):
        calls.append((seconds, len(clock)))
        return STEPS

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fitting, "PROBED", 3)
        patch.setattr(fitting, "steps_within", steps_within)
        fit(tiny_capture(), folder, set=[*SMALL, "seconds=12"])
    assert calls == [(12.0, 3)]
    return folder


def test_a_plain_field_learns_for_the_steps_of_its_time(run_folder):
    assert len((run_folder / run.METRICS).read_text().splitlines()) == STEPS
    assert checkpoint.load(run_folder).config["lr_steps"] == STEPS
    _, held_out = tiny_capture().split()
    texture = PlainFieldTexture.load(run_folder)
    view, photo = render_view(texture.field, held_out, 0)
    assert psnr(view, photo) > 3 + psnr(np.ones_like(photo), photo)
    assert texture.about["name"] == "tiny" and texture.about["steps"] == STEPS


def test_a_run_that_goes_on_keeps_its_steps(run_folder, monkeypatch):
    monkeypatch.setattr(fitting, "train_plain_field", None)  # which would probe again
    texture = fit(tiny_capture(), run_folder, resume=True)
    assert texture.about["steps"] == STEPS


def test_a_texture_survives_saving(run_folder, tmp_path):
    texture = PlainFieldTexture.load(run_folder)
    again = PlainFieldTexture.load(texture.save(tmp_path / "copy.safetensors"))
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (500, 3)).astype(np.float32)
    assert np.array_equal(again.field.density_at(points), texture.field.density_at(points))
    assert np.array_equal(again.occupied, texture.occupied) and dict(again.about) == dict(texture.about)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda p: {k: v for k, v in p.items() if k != "weights/1"}, "another shape"),
        (lambda p: {**p, "table": p["table"][:-8]}, "another shape"),
        (lambda p: {**p, "table": p["table"] * np.nan}, "not finite"),
    ],
)
def test_damaged_files_are_refused(run_folder, tmp_path, change, why):
    texture = PlainFieldTexture.load(run_folder)
    damaged = PlainFieldTexture(change(dict(texture.parameters)), texture.occupied, texture.about)
    with pytest.raises(CheckpointError, match=why):
        PlainFieldTexture.load(damaged.save(tmp_path / "damaged.safetensors"))


class Ball:
    """A field that is dense within 0.5 of a point, and shows the direction in which it is seen."""

    mask, step = np.ones((16,) * 3, np.uint8), 0.05
    density_value = 8.0  # a third of what is solid on a grid of 48 cells

    def density_at(self, points):
        inside = np.linalg.norm(points - np.array([0.2, 0, 0]), axis=1) < 0.5
        return np.where(inside, self.density_value, 0).astype(np.float32)

    def evaluate(self, points, view):
        count = dr.width(points)
        colour = mi.Color3f(0.5 + 0.5 * view)
        return dr.arange(mi.UInt32, count), dr.full(mi.Float, self.density_value, count), colour


@pytest.fixture
def ball() -> PlainFieldTexture:
    """In a world of other size, somewhere else."""
    about: dict[str, Any] = {"name": "ball", "centre": [10.0, 0.0, -3.0], "scale": 4.0}
    texture = PlainFieldTexture({}, Ball.mask, about)
    texture.__dict__["field"] = Ball()
    return texture


def test_what_is_solid_is_a_mesh_in_the_capture_s_world(ball):
    """Where the colours are those that are seen against the normals."""
    asset = ball.apply(density=100.0).surface
    radii = np.linalg.norm(asset.mesh.vertices - np.array([10.0 + 4.0 * 0.2, 0.0, -3.0]), axis=1)
    assert np.abs(radii - 4.0 * 0.5).max() < 4.0 * 2 / 48
    expected = 0.5 - 0.5 * asset.mesh.normals
    assert np.abs(asset.vertex_maps["albedo"] - expected).max() < 1e-5
    outward = asset.mesh.vertices - asset.mesh.vertices.mean(0)
    assert ((outward * asset.mesh.normals).sum(1) > 0).all()


def test_the_density_says_what_is_solid(ball, tmp_path):
    with pytest.raises(MeshError, match="nothing in 'ball' is solid"):
        ball.apply().export(tmp_path / "ball.ply")
    assert not list(tmp_path.iterdir())
    written = Asset.load(ball.apply(density=4.0).export(tmp_path / "ball.ply"))
    assert len(written.mesh.faces) > 100


def test_pictures_show_the_occupied_part_of_the_world(ball, tmp_path, monkeypatch):
    calls = []

    def still(field, similarity, outline, **options):
        calls.append((field, similarity, outline, options))
        return np.full((8, 8, 3), 0.5, np.float32)

    monkeypatch.setattr(shell, "shell_still", still)
    applied = ball.apply(density=2.0)
    assert applied.render(tmp_path / "ball.png", resolution=64, azimuth=1.0).is_file()
    ((field, similarity, outline, options),) = calls
    assert field is applied and options == {"resolution": 64, "azimuth": 1.0}
    assert similarity.scale == 4.0 and similarity.centre.tolist() == [10.0, 0.0, -3.0]
    low, high = outline.min(0), outline.max(0)
    np.testing.assert_allclose(high - low, 4.0 * 2 * 15 / 16)
    np.testing.assert_allclose((low + high) / 2, [10.0, 0.0, -3.0], atol=1e-6)


def test_densities_are_multiplied(ball):
    applied = ball.apply(density=3.0)
    _, density, _ = applied.evaluate(mi.Point3f(0.2, 0, 0), mi.Vector3f(0, 0, 1))
    assert density[0] == pytest.approx(24.0)
    assert applied.density(np.array([[0.2, 0, 0]]))[0] == pytest.approx(24.0)


def test_refusals(ball):
    with pytest.raises(ConfigError, match="cannot be put on 'icosphere"):
        ball.apply(icosphere(1))
    for density in (0.0, 1001.0, np.nan):
        with pytest.raises(ConfigError, match="`density`"):
            ball.apply(density=density)


@pytest.mark.parametrize(
    "change",
    [
        "rays=512",
        "one_view=true",
        "colour_loss=l2",
        "ray_steps=96",
        "distortion=1",
        "occupancy=24",
        "table=12",
        "seed=1",
    ],
)
def test_every_setting_changes_the_first_step(change, known_hulls):
    losses = []
    for settings in (SMALL, [*SMALL, change]):
        config = resolve(PRESETS, overrides=settings)
        task = PlainTask(config, tiny_capture(), (tiny_capture(), 0))
        losses.append(task.loss(0, torch.Generator().manual_seed(0)).value.item())
    assert losses[0] != losses[1]
