"""A training and its caller: progress, cancelling, memory in place of a folder, other threads."""

import math
import os
import signal
import threading
from dataclasses import FrozenInstanceError, replace

import pytest
import torch

from mitex.errors import CheckpointError, MitexError
from mitex.training import Cancelled, Interrupted, TrainingDiverged, checkpoint, train
from mitex.training.control import Control

from .task import SmallConfig, SmallTask, assert_same_run

pytestmark = pytest.mark.usefixtures("one_thread")

CONFIG = SmallConfig()


def fit(out, task=None, steps=20, resume=False, **options):
    config = replace(CONFIG, steps=steps)
    return train(task or SmallTask(), config, out, lr=0.01, resume=resume, control=Control(**options))


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """A current folder; nothing must be written to it."""
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    assert not list(tmp_path.iterdir())


def test_every_step_is_told(tmp_path):
    heard = []
    fit(tmp_path, on_step=heard.append)
    assert [(p.stage, p.step, p.steps) for p in heard] == [("small", step, 20) for step in range(21)]
    start, first, *_, last = heard
    assert math.isnan(start.loss) and not start.metrics and start.speed is start.seconds_left is None
    assert {"loss", "error", "target"} <= first.metrics.keys() and first.loss == first.metrics["loss"]
    assert first.seconds_left > 0 and first.speed > 0 and last.seconds_left == 0
    assert 0 < first.seconds < last.seconds and last.loss != last.metrics["loss"]
    with pytest.raises(FrozenInstanceError):
        start.step = 3


def test_a_resumed_run_tells_where_it_is(tmp_path):
    fit(tmp_path, steps=5)
    heard = []
    fit(tmp_path, resume=True, on_step=heard.append)
    assert [p.step for p in heard] == list(range(5, 21))


def test_what_the_callback_raises_ends_the_fit(tmp_path):
    def complain(progress):
        if progress.step == 12:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fit(tmp_path, on_step=complain)
    assert checkpoint.load(tmp_path).step == 10


def cancelling(at):
    """Options that cancel a fit when so many steps are done."""
    event = threading.Event()
    return {"cancel": event, "on_step": lambda p: event.set() if p.step == at else None}


def test_a_cancelled_run_saves_and_goes_on(tmp_path):
    fit(tmp_path / "whole")
    with pytest.raises(Cancelled, match="cancelled after step 8; .*`resume=True`") as error:
        fit(tmp_path / "run", **cancelling(8))
    assert isinstance(error.value, MitexError)
    assert (error.value.step, error.value.checkpoint) == (8, tmp_path / "run" / checkpoint.NAME)
    fit(tmp_path / "run", resume=True)
    assert_same_run(tmp_path / "whole", tmp_path / "run")


def test_cancelling_before_the_first_step_takes_none(nowhere):
    task = SmallTask()
    with pytest.raises(Cancelled) as error:
        fit(None, task, **cancelling(0))
    assert not task.steps_seen and error.value.checkpoint is None


def test_cancelling_after_the_last_step_changes_nothing(nowhere):
    assert fit(None, **cancelling(20)).steps == 20


def test_in_memory_the_result_is_the_same_and_nothing_is_written(tmp_path, nowhere):
    one, other = SmallTask(), SmallTask()
    heard = []
    result = fit(None, one, on_step=heard.append)
    assert result.steps == 20 and len(heard) == 21
    assert result.loss == heard[-1].loss
    assert not list(nowhere.iterdir())
    fit(tmp_path / "run", other)
    assert all(torch.equal(value, other.state()[name]) for name, value in one.state().items())
    for path in sorted((tmp_path / "run").iterdir()):
        path.unlink()
    (tmp_path / "run").rmdir()


def test_memory_has_nothing_to_resume(nowhere):
    with pytest.raises(CheckpointError, match="nothing to resume in memory; .*`out`"):
        fit(None, resume=True)


def test_in_memory_divergence_and_signals_leave_nothing(nowhere):
    bad = {step: lambda task, loss: loss * math.nan for step in (4, 5, 6)}
    with pytest.raises(TrainingDiverged, match="nothing has been kept; set a smaller"):
        fit(None, SmallTask(faults=bad))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        send = {3: lambda task, loss: os.kill(os.getpid(), signal.SIGINT) or loss}
        with pytest.raises(Interrupted, match="nothing has been kept"):
            fit(None, SmallTask(faults=send))
    finally:
        signal.signal(signal.SIGINT, before)


def test_another_thread_fits_and_is_cancelled(tmp_path):
    """Handlers of signals stay as they are meanwhile: only the main thread may set them."""
    event, ends, handlers = threading.Event(), [], []
    before = signal.getsignal(signal.SIGINT)

    def hear(progress):
        handlers.append(signal.getsignal(signal.SIGINT))
        if progress.step == 6:
            event.set()

    def work():
        try:
            fit(tmp_path, on_step=hear, cancel=event)
        except Cancelled as e:
            ends.append(e)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join(60)
    assert [e.step for e in ends] == [6] and checkpoint.load(tmp_path).step == 6
    assert set(handlers) == {before}


def test_the_log_tells_the_start(tmp_path, caplog):
    with caplog.at_level("INFO", "mitex"):
        fit(tmp_path, steps=5)
        fit(tmp_path, resume=True)
        fit(None, steps=1)
    assert caplog.messages == [
        f"small starts, 5 steps; output in {tmp_path}",
        f"small continues at step 5 of 20; output in {tmp_path}",
        "small starts, 1 steps; output in memory",
    ]
