"""Checkpoint files: round trip, the previous one, damage, a full disk."""

import json
import math
import os
import resource
import struct
from dataclasses import replace

import pytest
import torch
from safetensors.torch import save_file

from mitex.errors import CheckpointError, MitexWarning, OutputError
from mitex.training import checkpoint
from mitex.training.checkpoint import NAME, PREVIOUS, Checkpoint


def _checkpoint(step=5, **changes):
    values = {
        "step": step,
        "seconds": 1.5,
        "loss": 0.1 + 0.2,
        "skipped": 0,
        "config": {"steps": 9, "layers": ["a"], "init": None},
        "task": {"a/b": torch.full((2, 3), float(step)), "empty": torch.zeros(0, 4)},
        "optimizer": {"counts": torch.tensor([step])},
        "generator": torch.Generator().manual_seed(step).get_state(),
        "metadata": {"method": "small", "name": "ü"},
    }
    return Checkpoint(**(values | changes))


def _assert_same(one, other):
    for key, value in vars(one).items():
        back = getattr(other, key)
        if key in ("task", "optimizer"):
            assert value.keys() == back.keys()
            for name in value:
                assert value[name].dtype == back[name].dtype
                assert torch.equal(value[name], back[name]), name
        elif key == "generator":
            assert torch.equal(value, back)
        else:
            assert value == back, key


def test_round_trip(tmp_path):
    task = {
        "half": torch.tensor([1.5, -0.0, math.inf], dtype=torch.bfloat16),
        "parameter": torch.nn.Parameter(torch.tensor(2.0)),
        "strided": torch.arange(12.0).reshape(3, 4).T,
        "flags": torch.tensor([True, False]),
        "index": torch.tensor([2**40]),
    }
    before = _checkpoint(task=task)
    checkpoint.save(tmp_path, before)
    _assert_same(before, checkpoint.load(tmp_path))
    assert [p.name for p in tmp_path.iterdir()] == [NAME]


def test_others_may_read_it_as_the_umask_says(tmp_path):
    before = os.umask(0o027)
    try:
        checkpoint.save(tmp_path, _checkpoint())
    finally:
        os.umask(before)
    assert (tmp_path / NAME).stat().st_mode & 0o777 == 0o640


def test_a_loss_before_the_first_step_is_nan(tmp_path):
    checkpoint.save(tmp_path, _checkpoint(0, loss=math.nan))
    assert math.isnan(checkpoint.load(tmp_path).loss)


def test_what_was_loaded_does_not_hang_on_the_file(tmp_path):
    checkpoint.save(tmp_path, _checkpoint(5))
    loaded = checkpoint.load(tmp_path)
    loaded.task["a/b"].fill_(-1)
    for step in (6, 7):
        checkpoint.save(tmp_path, _checkpoint(step))
    assert (loaded.task["a/b"] == -1).all()
    assert (checkpoint.load(tmp_path).task["a/b"] == 7).all()


def test_the_previous_one_is_kept(tmp_path):
    for step in (1, 2, 3):
        checkpoint.save(tmp_path, _checkpoint(step))
    assert checkpoint.read(tmp_path / NAME).step == 3
    assert checkpoint.read(tmp_path / PREVIOUS).step == 2
    assert len(list(tmp_path.iterdir())) == 2


def _cut(data, _):
    return data[: len(data) // 2]


DAMAGE = {
    "cut": _cut,
    "one byte short": lambda data, _: data[:-1],
    "empty": lambda data, _: b"",
    "zeros": lambda data, _: bytes(len(data)),
    "text": lambda data, _: b"hello",
    "huge header": lambda data, _: struct.pack("<Q", 2**60) + data[8:],
    "not ours": lambda data, path: save_file({"a": torch.ones(2)}, path) or path.read_bytes(),
    "no generator": lambda data, path: (
        save_file({"task/a": torch.ones(2)}, path, {"mitex_checkpoint": "1", "run": json.dumps({"step": 1})})
        or path.read_bytes()
    ),
    "no run": lambda data, path: (
        save_file({"generator": torch.ones(2)}, path, {"mitex_checkpoint": "1", "run": "[]"})
        or path.read_bytes()
    ),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_one_gives_way_to_the_previous(tmp_path, damage):
    for step in (1, 2):
        checkpoint.save(tmp_path, _checkpoint(step))
    newest = tmp_path / NAME
    newest.write_bytes(DAMAGE[damage](newest.read_bytes(), tmp_path / "other"))
    with pytest.warns(MitexWarning, match="step 1"):
        loaded = checkpoint.load(tmp_path)
    _assert_same(_checkpoint(1), loaded)


def test_a_damaged_one_never_replaces_the_previous(tmp_path):
    for step in (1, 2):
        checkpoint.save(tmp_path, _checkpoint(step))
    (tmp_path / NAME).write_bytes(b"damaged")
    checkpoint.save(tmp_path, _checkpoint(3))
    assert checkpoint.read(tmp_path / NAME).step == 3
    assert checkpoint.read(tmp_path / PREVIOUS).step == 1


def test_only_the_previous_left(tmp_path):
    checkpoint.save(tmp_path, _checkpoint(1))
    os.replace(tmp_path / NAME, tmp_path / PREVIOUS)
    assert checkpoint.load(tmp_path).step == 1


def test_nothing_to_load(tmp_path):
    with pytest.raises(CheckpointError, match="no checkpoint in"):
        checkpoint.load(tmp_path)
    (tmp_path / NAME).write_bytes(b"x")
    (tmp_path / PREVIOUS).write_bytes(b"y")
    with pytest.raises(CheckpointError, match="cannot read checkpoint .*previous"):
        checkpoint.load(tmp_path)
    with pytest.raises(CheckpointError, match="No such file"):
        checkpoint.read(tmp_path / "none")


def test_a_full_disk_leaves_the_old_one(tmp_path):
    for step in (1, 2):
        checkpoint.save(tmp_path, _checkpoint(step))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(OutputError, match="checkpoint.safetensors"):
            checkpoint.save(tmp_path, _checkpoint(3, task={"big": torch.zeros(100_000)}))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert checkpoint.read(tmp_path / NAME).step == 2
    assert checkpoint.read(tmp_path / PREVIOUS).step == 1
    assert len(list(tmp_path.iterdir())) == 2


def test_no_space_is_named(tmp_path, monkeypatch):
    def refuse(*_):
        raise checkpoint.SafetensorError(
            "Error while serializing: I/O error: No space left on device (os error 28)"
        )

    monkeypatch.setattr(checkpoint, "save_file", refuse)
    with pytest.raises(OutputError, match="no space left"):
        checkpoint.save(tmp_path, _checkpoint())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "changes",
    [
        {"step": "five"},
        {"step": -1},
        {"step": True},
        {"skipped": -1},
        {"loss": "low"},
        {"seconds": math.inf},
        {"seconds": None},
        {"config": [1]},
    ],
    ids=str,
)
def test_counters_that_are_none(tmp_path, changes):
    checkpoint.save(tmp_path, replace(_checkpoint(), **changes))
    with pytest.raises(CheckpointError, match=NAME):
        checkpoint.load(tmp_path)


def test_a_description_without_end(tmp_path):
    metadata = {"mitex_checkpoint": checkpoint.FORMAT, "run": "[" * 100_000}
    save_file({"generator": torch.zeros(1)}, tmp_path / NAME, metadata)
    with pytest.raises(CheckpointError, match=NAME):
        checkpoint.load(tmp_path)
