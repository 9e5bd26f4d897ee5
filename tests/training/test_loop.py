"""The training loop: resume, divergence, interruption, records."""

import json
import math
import os
import signal
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest
import torch
from PIL import Image

from mitex.errors import CheckpointError, ConfigError, MitexWarning, OutputError
from mitex.training import Interrupted, TrainingDiverged, checkpoint, train
from mitex.training.state import TrainState

from .contract import FAULTS, assert_loss_is_pure, assert_third_step_leaves_no_trace, spoiled
from .task import SmallConfig, SmallTask, assert_same_run, lines


@pytest.fixture(autouse=True)
def _one_thread():
    torch.set_num_threads(1)


def _train(out, task=None, config=None, **options):
    task = task or SmallTask()
    config = config or SmallConfig()
    arguments: dict[str, Any] = {"lr": config.lr} | options
    return task, train(task, config, out, **arguments)


def _nan(task, loss):
    return loss * math.nan


def _bad_gradient(task, loss):
    return loss + (task.weight - task.weight.detach()).abs().sqrt().sum()  # 0 with a gradient of 0 / 0


def _signal(number):
    def send(task, loss):
        os.kill(os.getpid(), number)
        return loss

    return send


def test_it_learns(tmp_path):
    _, result = _train(tmp_path / "a", config=SmallConfig(steps=300, checkpoint_every=100), lr=0.05)
    losses = [line["loss"] for line in lines(tmp_path / "a")]
    assert sum(losses[-50:]) < 0.3 * sum(losses[:50])
    assert result.steps == 300
    mean = 0.0
    for i, loss in enumerate(losses):
        mean += (loss - mean) / min(i + 1, 50)
    assert math.isclose(result.loss, mean, rel_tol=1e-9)


@pytest.mark.parametrize("normalise", [False, True])
def test_a_resumed_run_is_bit_identical(tmp_path, normalise):
    options = {"milestones": [4, 15], "decay": 0.5, "normalise_gradients": normalise}
    whole, expected = _train(tmp_path / "whole", **options)
    _train(tmp_path / "parts", config=SmallConfig(steps=12), **options)
    other = SmallTask()
    with torch.no_grad():
        other.weight.fill_(9)  # everything must come from the checkpoint
    resumed, result = _train(tmp_path / "parts", other, resume=True, **options)
    assert_same_run(tmp_path / "whole", tmp_path / "parts")
    assert (result.steps, result.loss) == (expected.steps, expected.loss)
    assert resumed.steps_seen == list(range(12, 20))
    for name, tensor in whole.state().items():
        assert torch.equal(tensor, resumed.state()[name])


def test_lost_steps_are_repeated(tmp_path):
    """What a kill leaves: metrics beyond the checkpoint, half a line."""
    _train(tmp_path / "whole")
    folder = tmp_path / "killed"
    _train(folder, config=SmallConfig(steps=10))
    with (folder / "metrics.jsonl").open("a") as file:
        file.write('{"step": 11, "loss": 0.5}\n{"step": 12, "lo')
    _train(folder, resume=True)
    assert_same_run(tmp_path / "whole", folder)


def test_a_damaged_checkpoint_costs_only_the_steps_since_the_one_before(tmp_path):
    _train(tmp_path / "whole")
    folder = tmp_path / "damaged"
    _train(folder, config=SmallConfig(steps=12))
    newest = folder / checkpoint.NAME
    newest.write_bytes(newest.read_bytes()[:-3])
    with pytest.warns(MitexWarning, match="step 10"):
        resumed, _ = _train(folder, resume=True)
    assert resumed.steps_seen[0] == 10
    assert_same_run(tmp_path / "whole", folder)


def test_a_finished_run_resumes_to_its_result(tmp_path):
    _, first = _train(tmp_path)
    task, again = _train(tmp_path, resume=True)
    assert not task.steps_seen
    assert (again.steps, again.loss) == (first.steps, first.loss)
    assert len(lines(tmp_path)) == 20


def test_seconds_go_on(tmp_path, monkeypatch):
    """By a clock that goes on by a second whenever it is looked at."""
    monkeypatch.setattr("mitex.training.state.time", SimpleNamespace(monotonic=count().__next__))
    _, first = _train(tmp_path, config=SmallConfig(steps=5))
    _, second = _train(tmp_path, resume=True)
    assert second.seconds > first.seconds
    seconds = [json.loads(line)["seconds"] for line in (tmp_path / "metrics.jsonl").read_text().splitlines()]
    assert seconds == sorted(seconds)


@pytest.mark.parametrize(
    ("config", "task", "message"),
    [
        (SmallConfig(seed=4), None, "seed 3, not 4"),
        (SmallConfig(layers=("a", "b")), None, "layers"),
        (SmallConfig(width=6), SmallTask(6), "width 5, not 6"),
        (SmallConfig(), SmallTask(6), "parameter 0 has shape"),
        (SmallConfig(), SmallTask(5, pool=8), "pool of"),
    ],
)
def test_a_checkpoint_of_something_else_is_refused(tmp_path, config, task, message):
    _train(tmp_path, config=SmallConfig(steps=5))
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(CheckpointError, match=message):
        _train(tmp_path, task, config, resume=True)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_checkpoint_of_another_method_is_refused(tmp_path, monkeypatch):
    _train(tmp_path, config=SmallConfig(steps=5))
    monkeypatch.setattr(SmallTask, "metadata", lambda self: {"method": "large"})
    with pytest.raises(CheckpointError, match="method 'small', not 'large'"):
        _train(tmp_path, resume=True)


def test_the_learning_rate_may_change(tmp_path):
    _train(tmp_path, config=SmallConfig(steps=5))
    _train(tmp_path, config=SmallConfig(lr=0.5), resume=True)
    assert "lr = 0.5" in (tmp_path / "config.toml").read_text()


def test_lr_may_be_a_function(tmp_path):
    steps = []
    _train(tmp_path, lr=lambda step: steps.append(step) or 0.0)
    assert steps == list(range(20))


def test_folders_are_not_overwritten(tmp_path):
    _train(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(OutputError, match="resume=True"):
        _train(tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    with pytest.raises(CheckpointError, match="no checkpoint"):
        _train(tmp_path / "none", resume=True)
    assert not (tmp_path / "none").exists()


def test_an_error_in_the_first_step_leaves_nothing(tmp_path):
    def fail(task, loss):
        raise OutputError("a", "b")

    with pytest.raises(OutputError):
        _train(tmp_path / "run", SmallTask(faults={0: fail}))
    assert not list(tmp_path.iterdir())
    with pytest.raises(ConfigError):
        _train(tmp_path / "run", config=SmallConfig(checkpoint_every=0))


@pytest.mark.parametrize(("fault", "kind"), [(_nan, "loss"), (_bad_gradient, "gradient")])
def test_a_bad_step_is_skipped(tmp_path, fault, kind):
    """Training goes on, and the records tell."""
    _train(tmp_path, SmallTask(faults={7: fault, 8: fault}))
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


@pytest.mark.parametrize("step", [0, 1])
def test_the_loss_changes_nothing(step):
    assert_loss_is_pure(SmallTask(), step)


def test_skipped_steps_in_separate_rows_do_not_end_a_run(tmp_path):
    _, result = _train(tmp_path, SmallTask(faults={step: _nan for step in (1, 2, 4, 5, 7, 8)}))
    assert result.steps == 20
    assert math.isfinite(result.loss)


@pytest.mark.parametrize(("fault", "kind"), [(_nan, "loss"), (_bad_gradient, "gradient")])
def test_divergence_keeps_the_good_checkpoint_and_can_be_resumed(tmp_path, fault, kind):
    _train(tmp_path / "whole")
    out = tmp_path / "run"
    task = SmallTask(faults={step: fault for step in range(13, 20)})
    with pytest.raises(TrainingDiverged) as error:
        _train(out, task)
    message = str(error.value)
    assert f"the {kind} was not finite in 3 steps in a row, up to step 16" in message
    assert str(out / checkpoint.NAME) in message
    assert "smaller learning rate" in message
    assert checkpoint.load(out).step == 10  # 15 was due in the middle of the bad row
    dump = json.loads((out / "diverged.json").read_text())
    assert (dump["step"], dump["skipped"], "error" in dump) == (16, kind, True)
    assert dump["gradient_norms"] == (["nan", dump["gradient_norms"][1]] if kind == "gradient" else [])
    _train(out, resume=True)
    assert_same_run(tmp_path / "whole", out)
    assert not (out / "diverged.json").exists()


def test_divergence_before_a_checkpoint_can_start_again(tmp_path):
    with pytest.raises(TrainingDiverged, match="no checkpoint had been reached"):
        _train(tmp_path, SmallTask(faults={step: _nan for step in range(9)}))
    _, result = _train(tmp_path)
    assert result.steps == 20
    assert len(lines(tmp_path)) == 20


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_saves_and_goes_on(tmp_path, number):
    _train(tmp_path / "whole")
    out = tmp_path / "run"
    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(Interrupted, match="after step 8.*resume=True") as error:
            _train(out, SmallTask(faults={7: _signal(number)}))
        assert signal.getsignal(number) is signal.default_int_handler
    finally:
        signal.signal(number, before)
    assert isinstance(error.value, KeyboardInterrupt)
    assert (error.value.step, error.value.checkpoint) == (8, out / checkpoint.NAME)
    assert checkpoint.load(out).step == 8
    _train(out, resume=True)
    assert_same_run(tmp_path / "whole", out)


def test_an_interrupt_between_bad_steps_keeps_their_count(tmp_path):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        faults = {7: _nan, 8: lambda task, loss: _signal(signal.SIGINT)(task, _nan(task, loss)), 9: _nan}
        with pytest.raises(Interrupted):
            _train(tmp_path, SmallTask(faults=faults))
    finally:
        signal.signal(signal.SIGINT, before)
    assert checkpoint.load(tmp_path).skipped == 2
    with pytest.raises(TrainingDiverged, match="up to step 10"):
        _train(tmp_path, SmallTask(faults=faults), resume=True)


def test_a_second_interrupt_stops_inside_the_step(tmp_path):
    def twice(task, loss):
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        raise AssertionError("not reached")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt) as error:
            _train(tmp_path, SmallTask(faults={7: twice}))
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert not isinstance(error.value, Interrupted)
    assert checkpoint.load(tmp_path).step == 5
    _train(tmp_path, resume=True)
    assert len(lines(tmp_path)) == 20


def test_previews_and_checkpoints_come_when_due(tmp_path, monkeypatch):
    saved = []
    real = checkpoint.save
    monkeypatch.setattr(checkpoint, "save", lambda folder, c: saved.append(c.step) or real(folder, c))
    _train(tmp_path, config=SmallConfig(preview_every=8, checkpoint_every=6))
    assert saved == [6, 12, 18, 20]
    assert sorted(path.name for path in (tmp_path / "previews").iterdir()) == [
        "000008.png",
        "000016.png",
        "000020.png",
    ]
    with Image.open(tmp_path / "previews" / "000008.png") as image:
        assert image.size == (6, 4)


def test_previews_do_not_change_the_run(tmp_path):
    _train(tmp_path / "with", config=SmallConfig(preview_every=1))
    _train(tmp_path / "without")
    assert_same_run(tmp_path / "with", tmp_path / "without")


def test_the_seed_decides(tmp_path):
    for name, seed in (("a", 3), ("b", 4)):
        _train(tmp_path / name, config=SmallConfig(seed=seed))
    assert lines(tmp_path / "a") != lines(tmp_path / "b")


def test_metrics_of_a_task_cannot_hide_the_loops(tmp_path, monkeypatch):
    real = SmallTask.loss

    def loss(self, step, generator):
        result = real(self, step, generator)
        metrics = {"step": -1, "loss": -1, "seconds": -1, "views": torch.tensor(6)}
        return replace(result, metrics={**result.metrics, **metrics})

    monkeypatch.setattr(SmallTask, "loss", loss)
    _train(tmp_path, config=replace(SmallConfig(), steps=1))
    record = json.loads((tmp_path / "metrics.jsonl").read_text())
    assert (record["step"], record["views"]) == (1, 6.0)
    assert record["loss"] >= 0
    assert record["seconds"] >= 0


def test_a_full_disk_ends_the_run_but_not_the_checkpoint(tmp_path, monkeypatch):
    _train(tmp_path / "whole")
    out = tmp_path / "run"

    def full(tensors, *rest):
        raise checkpoint.SafetensorError("I/O error: No space left on device (os error 28)")

    def fill(task, loss):
        monkeypatch.setattr(checkpoint, "save_file", full)
        return loss

    with pytest.raises(OutputError, match="no space left"):
        _train(out, SmallTask(faults={12: fill}))
    monkeypatch.undo()
    assert checkpoint.load(out).step == 10
    _train(out, resume=True)
    assert_same_run(tmp_path / "whole", out)
