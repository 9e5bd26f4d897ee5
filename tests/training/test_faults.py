"""What ends a training or a step of it: numbers that are not finite, interrupts, errors, a full disk."""

import json
import math
import os
import signal
from contextlib import contextmanager
from unittest.mock import patch

import pytest
import torch

from mitex.errors import ConfigError, OutputError
from mitex.training import Interrupted, TrainingDiverged, checkpoint
from mitex.training.state import TrainState

from .contract import FAULTS, assert_third_step_leaves_no_trace, spoiled
from .task import SmallConfig, SmallTask, assert_same_run, lines, train_small

pytestmark = pytest.mark.usefixtures("one_thread")


def _nan(task, loss):
    return loss * math.nan


def _bad_gradient(task, loss):
    return loss + (task.weight - task.weight.detach()).abs().sqrt().sum()  # 0 with a gradient of 0 / 0


def _signal(number):
    def send(task, loss):
        os.kill(os.getpid(), number)
        return loss

    return send


def test_an_error_in_the_first_step_leaves_nothing(tmp_path):
    def fail(task, loss):
        raise OutputError("a", "b")

    with pytest.raises(OutputError):
        train_small(tmp_path / "run", SmallTask(faults={0: fail}))
    assert not list(tmp_path.iterdir())
    with pytest.raises(ConfigError):
        train_small(tmp_path / "run", config=SmallConfig(checkpoint_every=0))


@pytest.mark.parametrize(("fault", "kind"), [(_nan, "loss"), (_bad_gradient, "gradient")])
def test_a_bad_step_is_skipped(tmp_path, fault, kind):
    """Training goes on, and the records tell."""
    train_small(tmp_path, SmallTask(faults={7: fault, 8: fault}))
    records = lines(tmp_path)
    assert [record["step"] for record in records if "skipped" in record] == [8, 9]
    assert records[7]["skipped"] == kind
    assert (records[7]["loss"] is None) is (kind == "loss")
    assert checkpoint.load(tmp_path).optimizer["counts"].tolist() == [18, 18]
    assert len(records) == 20


@contextmanager
def spoiled_target(task, fault):
    """What `begin` changes becomes NaN."""
    with patch.object(torch, "randn", lambda *_, **__: torch.tensor(math.nan)):
        yield


@pytest.mark.parametrize(("fault", "means"), [*((f, spoiled) for f in FAULTS), ("target", spoiled_target)])
def test_a_skipped_step_leaves_every_byte(fault, means):
    assert_third_step_leaves_no_trace(SmallTask, SmallConfig(), fault, means)


def test_a_fault_of_begin_costs_no_loss(tmp_path):
    """The loss is not asked for, and the step's line has null for what was not finite."""
    task = SmallTask()
    state = TrainState(task, SmallConfig(), lambda step: 0.1, normalise=False)
    with spoiled_target(task, "target"):
        record = state.advance()
    assert not task.steps_seen and task.target == 1
    assert record["skipped"] == "target" and math.isnan(record["target"]) and math.isnan(record["loss"])


def test_skipped_steps_in_separate_rows_do_not_end_a_run(tmp_path):
    _, result = train_small(tmp_path, SmallTask(faults={step: _nan for step in (1, 2, 4, 5, 7, 8)}))
    assert result.steps == 20
    assert math.isfinite(result.loss)


@pytest.mark.parametrize(("fault", "kind"), [(_nan, "loss"), (_bad_gradient, "gradient")])
def test_divergence_keeps_the_good_checkpoint_and_can_be_resumed(tmp_path, fault, kind):
    train_small(tmp_path / "whole")
    out = tmp_path / "run"
    task = SmallTask(faults={step: fault for step in range(13, 20)})
    with pytest.raises(TrainingDiverged) as error:
        train_small(out, task)
    message = str(error.value)
    assert f"the {kind} was not finite in 3 steps in a row, up to step 16" in message
    assert str(out / checkpoint.NAME) in message
    assert "smaller learning rate" in message
    assert checkpoint.load(out).step == 10  # 15 was due in the middle of the bad row
    dump = json.loads((out / "diverged.json").read_text())
    assert (dump["step"], dump["skipped"], "error" in dump) == (16, kind, True)
    assert dump["gradient_norms"] == (["nan", dump["gradient_norms"][1]] if kind == "gradient" else [])
    train_small(out, resume=True)
    assert_same_run(tmp_path / "whole", out)
    assert not (out / "diverged.json").exists()


def test_divergence_before_a_checkpoint_can_start_again(tmp_path):
    with pytest.raises(TrainingDiverged, match="no checkpoint had been reached"):
        train_small(tmp_path, SmallTask(faults={step: _nan for step in range(9)}))
    _, result = train_small(tmp_path)
    assert result.steps == 20
    assert len(lines(tmp_path)) == 20


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_saves_and_goes_on(tmp_path, number):
    train_small(tmp_path / "whole")
    out = tmp_path / "run"
    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(Interrupted, match="after step 8.*resume=True") as error:
            train_small(out, SmallTask(faults={7: _signal(number)}))
        assert signal.getsignal(number) is signal.default_int_handler
    finally:
        signal.signal(number, before)
    assert isinstance(error.value, KeyboardInterrupt)
    assert (error.value.step, error.value.checkpoint) == (8, out / checkpoint.NAME)
    assert checkpoint.load(out).step == 8
    train_small(out, resume=True)
    assert_same_run(tmp_path / "whole", out)


def test_an_interrupt_between_bad_steps_keeps_their_count(tmp_path):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        faults = {7: _nan, 8: lambda task, loss: _signal(signal.SIGINT)(task, _nan(task, loss)), 9: _nan}
        with pytest.raises(Interrupted):
            train_small(tmp_path, SmallTask(faults=faults))
    finally:
        signal.signal(signal.SIGINT, before)
    assert checkpoint.load(tmp_path).skipped == 2
    with pytest.raises(TrainingDiverged, match="up to step 10"):
        train_small(tmp_path, SmallTask(faults=faults), resume=True)


def test_a_second_interrupt_stops_inside_the_step(tmp_path):
    def twice(task, loss):
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        raise AssertionError("not reached")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt) as error:
            train_small(tmp_path, SmallTask(faults={7: twice}))
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert not isinstance(error.value, Interrupted)
    assert checkpoint.load(tmp_path).step == 5
    train_small(tmp_path, resume=True)
    assert len(lines(tmp_path)) == 20


def test_a_full_disk_ends_the_run_but_not_the_checkpoint(tmp_path, monkeypatch):
    train_small(tmp_path / "whole")
    out = tmp_path / "run"

    def full(tensors, *rest):
        raise checkpoint.SafetensorError("I/O error: No space left on device (os error 28)")

    def fill(task, loss):
        monkeypatch.setattr(checkpoint, "save_file", full)
        return loss

    with pytest.raises(OutputError, match="no space left"):
        train_small(out, SmallTask(faults={12: fill}))
    monkeypatch.undo()
    assert checkpoint.load(out).step == 10
    train_small(out, resume=True)
    assert_same_run(tmp_path / "whole", out)
