"""The base shape of a capture: its training, which can be interrupted, and what is kept of it."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from mitex.errors import MeshError
from mitex.mesh import Mesh, icosphere, quality
from mitex.methods.nerf import PRESETS
from mitex.methods.nerf.base import coarse
from mitex.methods.nerf.base.base_shape import base_shape, given_base
from mitex.methods.nerf.base.coarse import find_base
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.training import plain
from mitex.methods.nerf.training.plain import PlainTask
from mitex.paths import cache_dir
from mitex.training import Interrupted, checkpoint
from tests.methods.nerf.tiny import captured, tiny_capture

STEPS, BEFORE = 12, 5
FEW = replace(PRESETS["fast"], base_steps=STEPS)


@pytest.fixture
def ball(tmp_path, monkeypatch) -> Mesh:
    """A base mesh, in place of one that so short a training could not give; and an empty cache. What a step
    of the training learns does not matter, so it is a small one."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(
        coarse, "COARSE", replace(coarse.COARSE, rays=32, ray_steps=64, table=8, occupancy=16)
    )
    monkeypatch.setattr(plain, "LEVELS", 2)
    mesh = icosphere(44)
    mesh = mesh.with_vertices(0.55 * mesh.vertices)
    monkeypatch.setattr(coarse, "scan_surface", lambda task: 1.1 * mesh.vertices[::20])
    return mesh


@pytest.fixture
def capture() -> Capture:
    return tiny_capture(views=6, side=24, spp=1)


def trainings() -> list[Path]:
    return list((cache_dir() / "nerf").glob("*.run"))


def interrupt(capture: Capture, ball: Mesh) -> None:
    """Stops a training after `BEFORE` steps."""
    with pytest.MonkeyPatch.context() as patch:
        average = PlainTask._average

        def stop(task: PlainTask) -> None:
            average(task)
            if task._commits == BEFORE:
                os.kill(os.getpid(), signal.SIGINT)

        patch.setattr(PlainTask, "_average", stop)
        with pytest.raises(Interrupted):
            find_base(capture, FEW, ball)
    assert len(trainings()) == 1


@pytest.fixture
def steps(monkeypatch) -> list[int]:
    """The steps that are done from now on."""
    done: list[int] = []
    loss = PlainTask.loss

    def counted(task: PlainTask, step: int, generator):
        done.append(step)
        return loss(task, step, generator)

    monkeypatch.setattr(PlainTask, "loss", counted)
    return done


@pytest.mark.parametrize(
    "change",
    [
        {"preset": "paper"},
        {"normals": 0.5},
        {"density_width": 16},
        {"repulsion": 0.2},
        {"checkpoint_every": 7},
    ],
)
def test_a_setting_of_the_fit_does_not_keep_the_training_from_going_on(capture, ball, steps, change):
    interrupt(capture, ball)
    steps.clear()
    find_base(capture, replace(FEW, **change), ball)
    assert steps == list(range(BEFORE, STEPS))


@pytest.mark.parametrize("change", [{"lr": 0.02}, {"seed": 3}])
def test_a_setting_of_the_coarse_field_begins_another_training(capture, ball, steps, change):
    interrupt(capture, ball)
    steps.clear()
    find_base(capture, replace(FEW, **change), ball)
    assert steps == list(range(STEPS))


def test_a_base_mesh_is_refused_before_the_training(capture, ball, steps):
    with pytest.raises(MeshError, match="scene cube"):
        find_base(capture, FEW, ball.with_vertices(3 * ball.vertices))
    assert not steps and not trainings()


def test_a_coarse_base_mesh_is_meshed_evenly(capture, ball, monkeypatch):
    monkeypatch.setattr(coarse, "given_base", partial(given_base, edge=0.05))
    rough = icosphere(3)
    base = find_base(capture, replace(FEW, base_steps=1), rough.with_vertices(0.55 * rough.vertices))
    assert quality(base.mesh).edge_length < 0.06 * 0.55 * 2 * 3**0.5


def test_the_same_photos_under_another_name_can_be_used(capture, ball, steps):
    interrupt(capture, ball)
    find_base(replace(capture, name="renamed"), FEW, ball)
    assert steps[-1] == STEPS - 1


def test_a_training_is_removed_once_the_base_shape_is_kept(capture, ball, steps):
    first = find_base(capture, FEW, ball)
    assert not trainings()
    steps.clear()
    again = find_base(capture, replace(FEW, normals=0.5), ball)
    assert not steps and (again.mesh.vertices == first.mesh.vertices).all()


def test_damaged_checkpoints_begin_anew(capture, ball, steps):
    interrupt(capture, ball)
    (trainings()[0] / checkpoint.NAME).write_bytes(b"no checkpoint")
    steps.clear()
    find_base(capture, FEW, ball)
    assert steps == list(range(STEPS)) and not trainings()


def test_the_checkpoint_before_is_enough_to_go_on(capture, ball, steps):
    interrupt(capture, ball)
    folder = trainings()[0]
    os.replace(folder / checkpoint.NAME, folder / checkpoint.PREVIOUS)
    steps.clear()
    find_base(capture, FEW, ball)
    assert steps == list(range(BEFORE, STEPS))


def test_trainings_that_nobody_goes_on_with_are_removed(capture, ball):
    folder = cache_dir() / "nerf"
    old, recent = folder / "old.run", folder / "recent.run"
    for training, days in ((old, 8), (recent, 6)):
        training.mkdir(parents=True)
        (training / "metrics.jsonl").touch()
        then = time.time() - days * 24 * 3600
        os.utime(training, (then, then))
    find_base(capture, FEW, ball)
    assert trainings() == [recent]


def dented_egg(frequency: int) -> Mesh:
    """An ellipsoid off the middle of the scene, with shallow dents."""
    ball = icosphere(frequency)
    dents = 1 - 0.08 * np.prod(np.cos(9 * ball.vertices), axis=1) ** 2
    egg = ball.vertices * dents[:, None] * (0.6, 0.45, 0.32) + (0.1, -0.05, 0.0)
    return Mesh(egg, ball.faces, name="egg")


def test_a_base_shape_is_found_in_photos_alone(tmp_path, monkeypatch):
    """The whole way: coarse field, scan, convex pieces, mesh; with few steps of many rays, and long edges."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    small = replace(coarse.COARSE, rays=2048, ray_steps=96, table=13, average=0.3)
    monkeypatch.setattr(coarse, "COARSE", small)
    monkeypatch.setattr(coarse, "GRID", 128)
    monkeypatch.setattr(coarse, "base_shape", partial(base_shape, edge=0.02))
    photos = captured(dented_egg(24), views=12, side=64, spp=8)
    base = find_base(photos, replace(PRESETS["fast"], base_steps=190))
    true = dented_egg(80).vertices
    report = quality(base.mesh)
    assert (report.components, report.boundary_edges, report.genus) == (1, 0, 0)
    surface = KDTree(true)
    to_surface, scan_to_surface = (surface.query(points)[0] for points in (base.mesh.vertices, base.scan))
    assert to_surface.mean() < 0.02 and to_surface.max() < 0.08
    assert scan_to_surface.mean() < 0.03
    for end in (np.min, np.max):
        np.testing.assert_allclose(end(base.mesh.vertices, axis=0), end(true, axis=0), atol=0.03)
    to_base, to_scan = (KDTree(points).query(true)[0] for points in (base.mesh.vertices, base.scan))
    assert np.quantile(to_base, 0.95) < base.thickness < 0.12  # the surface is in the shell
    assert np.quantile(to_scan, 0.95) < 0.05  # and was scanned from all sides
