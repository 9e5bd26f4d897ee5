"""Records that are written are the same when they are read."""

import csv
import errno
import json
import os

import pytest

from mitex.errors import OutputError
from mitex.records import write_csv, write_json

ODD_NAME = os.fsdecode(b'caf\xe9, "red"\n.png')  # as files can be called, but not in UTF-8


def test_json(tmp_path):
    record = {"name": ODD_NAME, "numbers": [1, 0.1, None], "text": "größer"}
    write_json(tmp_path / "new" / "a.json", record)
    assert json.loads((tmp_path / "new" / "a.json").read_bytes()) == record


def test_csv(tmp_path):
    rows = [{"name": ODD_NAME, "count": 3}, {"count": 4}]
    write_csv(tmp_path / "a.csv", ["name", "count"], rows)
    with (tmp_path / "a.csv").open(encoding="utf-8", errors="surrogateescape", newline="") as file:
        assert list(csv.reader(file)) == [["name", "count"], [ODD_NAME, "3"], ["", "4"]]


@pytest.mark.parametrize(
    "write", [lambda path: write_json(path, {"a": 1}), lambda path: write_csv(path, ["a"], [{"a": 1}])]
)
def test_an_old_file_survives_a_full_disk(write, tmp_path, monkeypatch):
    (tmp_path / "a").write_text("old")

    def refuse(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(OutputError, match="no space left"):
        write(tmp_path / "a")
    assert [file.name for file in tmp_path.iterdir()] == ["a"] and (tmp_path / "a").read_text() == "old"
