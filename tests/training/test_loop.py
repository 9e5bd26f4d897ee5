"""The training loop: learning, resuming, records and previews."""

import json
import math
from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import pytest
import torch
from PIL import Image

from mitex.errors import CheckpointError, MitexWarning, OutputError
from mitex.training import checkpoint

from .contract import assert_loss_is_pure
from .task import SmallConfig, SmallTask, assert_same_run, lines, train_small

pytestmark = pytest.mark.usefixtures("one_thread")


def test_it_learns(tmp_path):
    _, result = train_small(tmp_path / "a", config=SmallConfig(steps=300, checkpoint_every=100), lr=0.05)
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
    whole, expected = train_small(tmp_path / "whole", **options)
    train_small(tmp_path / "parts", config=SmallConfig(steps=12), **options)
    other = SmallTask()
    with torch.no_grad():
        other.weight.fill_(9)  # everything must come from the checkpoint
    resumed, result = train_small(tmp_path / "parts", other, resume=True, **options)
    assert_same_run(tmp_path / "whole", tmp_path / "parts")
    assert (result.steps, result.loss) == (expected.steps, expected.loss)
    assert resumed.steps_seen == list(range(12, 20))
    for name, tensor in whole.state().items():
        assert torch.equal(tensor, resumed.state()[name])


def test_lost_steps_are_repeated(tmp_path):
    """What a kill leaves: metrics beyond the checkpoint, half a line."""
    train_small(tmp_path / "whole")
    folder = tmp_path / "killed"
    train_small(folder, config=SmallConfig(steps=10))
    with (folder / "metrics.jsonl").open("a") as file:
        file.write('{"step": 11, "loss": 0.5}\n{"step": 12, "lo')
    train_small(folder, resume=True)
    assert_same_run(tmp_path / "whole", folder)


def test_a_damaged_checkpoint_costs_only_the_steps_since_the_one_before(tmp_path):
    train_small(tmp_path / "whole")
    folder = tmp_path / "damaged"
    train_small(folder, config=SmallConfig(steps=12))
    newest = folder / checkpoint.NAME
    newest.write_bytes(newest.read_bytes()[:-3])
    with pytest.warns(MitexWarning, match="step 10"):
        resumed, _ = train_small(folder, resume=True)
    assert resumed.steps_seen[0] == 10
    assert_same_run(tmp_path / "whole", folder)


def test_a_finished_run_resumes_to_its_result(tmp_path):
    _, first = train_small(tmp_path)
    task, again = train_small(tmp_path, resume=True)
    assert not task.steps_seen
    assert (again.steps, again.loss) == (first.steps, first.loss)
    assert len(lines(tmp_path)) == 20


def test_seconds_go_on(tmp_path, monkeypatch):
    """By a clock that goes on by a second whenever it is looked at."""
    monkeypatch.setattr("mitex.training.state.time", SimpleNamespace(monotonic=count().__next__))
    _, first = train_small(tmp_path, config=SmallConfig(steps=5))
    _, second = train_small(tmp_path, resume=True)
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
    train_small(tmp_path, config=SmallConfig(steps=5))
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(CheckpointError, match=message):
        train_small(tmp_path, task, config, resume=True)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_checkpoint_of_another_method_is_refused(tmp_path, monkeypatch):
    train_small(tmp_path, config=SmallConfig(steps=5))
    monkeypatch.setattr(SmallTask, "metadata", lambda self: {"method": "large"})
    with pytest.raises(CheckpointError, match="method 'small', not 'large'"):
        train_small(tmp_path, resume=True)


def test_the_learning_rate_may_change(tmp_path):
    train_small(tmp_path, config=SmallConfig(steps=5))
    train_small(tmp_path, config=SmallConfig(lr=0.5), resume=True)
    assert "lr = 0.5" in (tmp_path / "config.toml").read_text()


def test_lr_may_be_a_function(tmp_path):
    steps = []
    train_small(tmp_path, lr=lambda step: steps.append(step) or 0.0)
    assert steps == list(range(20))


def test_folders_are_not_overwritten(tmp_path):
    train_small(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(OutputError, match="resume=True"):
        train_small(tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    with pytest.raises(CheckpointError, match="no checkpoint"):
        train_small(tmp_path / "none", resume=True)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("step", [0, 1])
def test_the_loss_changes_nothing(step):
    assert_loss_is_pure(SmallTask(), step)


def test_previews_and_checkpoints_come_when_due(tmp_path, monkeypatch):
    saved = []
    real = checkpoint.save
    monkeypatch.setattr(checkpoint, "save", lambda folder, c: saved.append(c.step) or real(folder, c))
    train_small(tmp_path, config=SmallConfig(preview_every=8, checkpoint_every=6))
    assert saved == [6, 12, 18, 20]
    assert sorted(path.name for path in (tmp_path / "previews").iterdir()) == [
        "000008.png",
        "000016.png",
        "000020.png",
    ]
    with Image.open(tmp_path / "previews" / "000008.png") as image:
        assert image.size == (6, 4)


def test_previews_do_not_change_the_run(tmp_path):
    train_small(tmp_path / "with", config=SmallConfig(preview_every=1))
    train_small(tmp_path / "without")
    assert_same_run(tmp_path / "with", tmp_path / "without")


def test_the_seed_decides(tmp_path):
    for name, seed in (("a", 3), ("b", 4)):
        train_small(tmp_path / name, config=SmallConfig(seed=seed))
    assert lines(tmp_path / "a") != lines(tmp_path / "b")


def test_metrics_of_a_task_cannot_hide_the_loops(tmp_path, monkeypatch):
    real = SmallTask.loss

    def loss(self, step, generator):
        result = real(self, step, generator)
        metrics = {"step": -1, "loss": -1, "seconds": -1, "views": torch.tensor(6)}
        return replace(result, metrics={**result.metrics, **metrics})

    monkeypatch.setattr(SmallTask, "loss", loss)
    train_small(tmp_path, config=replace(SmallConfig(), steps=1))
    record = json.loads((tmp_path / "metrics.jsonl").read_text())
    assert (record["step"], record["views"]) == (1, 6.0)
    assert record["loss"] >= 0
    assert record["seconds"] >= 0
