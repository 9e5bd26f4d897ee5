"""metrics.jsonl."""

import json
import math
import os

import pytest

from mitex.errors import OutputError
from mitex.training.metrics import Metrics


def _write(path, steps):
    with Metrics(path) as metrics:
        for step in steps:
            metrics.write({"step": step, "loss": step / 3})


def test_lines_are_on_the_file_at_once_and_read_back(tmp_path):
    path = tmp_path / "m.jsonl"
    with Metrics(path) as metrics:
        metrics.write({"step": 1, "loss": 1 / 3})
        assert json.loads(path.read_text()) == {"step": 1, "loss": 1 / 3}
        metrics.write({"step": 2, "loss": math.nan, "size": math.inf})
    assert json.loads(path.read_text().splitlines()[1]) == {"step": 2, "loss": None, "size": None}


@pytest.mark.parametrize(("steps", "left"), [(0, []), (2, [1, 2]), (9, [1, 2, 3])])
def test_truncate_keeps_the_steps_of_the_checkpoint(tmp_path, steps, left):
    path = tmp_path / "m.jsonl"
    _write(path, [1, 2, 3])
    with Metrics(path) as metrics:
        metrics.truncate(steps)
        metrics.write({"step": steps + 1})
    assert [json.loads(line)["step"] for line in path.read_text().splitlines()] == [*left, steps + 1]


@pytest.mark.parametrize(
    "tail", [b'{"step": 2, "lo', b'{"step": 2}', b"\0\0\0\0\n", b"[]\n", b'{"a": 1}\n', b"\xff\n"]
)
def test_truncate_drops_a_torn_end(tmp_path, tail):
    path = tmp_path / "m.jsonl"
    _write(path, [1])
    whole = path.read_bytes()
    path.write_bytes(whole + tail)
    with Metrics(path) as metrics:
        metrics.truncate(5)
    assert path.read_bytes() == whole


def test_a_second_run_in_the_folder_is_refused(tmp_path):
    path = tmp_path / "m.jsonl"
    with Metrics(path), pytest.raises(OutputError, match="another process is training"):
        Metrics(path)
    Metrics(path).__exit__()


def test_the_disks_refusal_is_an_output_error(tmp_path):
    with pytest.raises(OutputError, match="Is a directory"):
        Metrics(tmp_path)
    with Metrics(tmp_path / "m.jsonl") as metrics:
        full = os.open("/dev/full", os.O_WRONLY)
        os.dup2(full, metrics._file.fileno())
        os.close(full)
        with pytest.raises(OutputError, match="No space left"):
            metrics.write({"step": 1})
