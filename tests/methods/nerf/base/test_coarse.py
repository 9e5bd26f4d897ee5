"""The base shape of a capture: its training, which can be interrupted, and what is kept of it."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import replace
from pathlib import Path

import pytest

from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import PRESETS, coarse
from mitex.methods.nerf.capture import Capture
from mitex.methods.nerf.coarse import find_base
from mitex.methods.nerf.plain import PlainTask
from mitex.paths import cache_dir
from mitex.training import Interrupted, checkpoint
from tests.methods.nerf.tiny import tiny_capture

STEPS, BEFORE = 12, 5
FEW = replace(PRESETS["fast"], base_steps=STEPS)


@pytest.fixture
def ball(tmp_path, monkeypatch) -> Mesh:
    """A base mesh, in place of one that so short a training could not give; and an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    mesh = icosphere(44)
    mesh = mesh.with_vertices(0.55 * mesh.vertices)
    monkeypatch.setattr(coarse, "scanned", lambda task: 1.1 * mesh.vertices)
    return mesh


@pytest.fixture
def capture() -> Capture:
    return tiny_capture(views=6, side=24, spp=1)


def trainings() -> list[Path]:
    return list((cache_dir() / "nerf").glob("*.run"))


def interrupt(capture: Capture, ball: Mesh) -> None:
    """Stops a training after `BEFORE` steps."""
    with pytest.MonkeyPatch.context() as patch:
        commit = PlainTask.commit

        def stop(task: PlainTask) -> None:
            commit(task)
            if task._commits == BEFORE:
                os.kill(os.getpid(), signal.SIGINT)

        patch.setattr(PlainTask, "commit", stop)
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
    [{"preset": "paper"}, {"normals": 0.5}, {"density_width": 16}, {"pull": 0.2}, {"checkpoint_every": 7}],
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
