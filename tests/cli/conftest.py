"""Fixtures of the command line's tests."""

import math

import pytest

from tests.cli import bad_files as bad


@pytest.fixture
def files(tmp_path, monkeypatch):
    """The working folder, with some good and bad files in it, and an empty `out`."""
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    bad.text(tmp_path / "good.obj", bad.CUBE)
    return tmp_path


@pytest.fixture(autouse=True)
def no_lines_of_progress(monkeypatch):
    """What a command writes to stderr does not depend on how fast the machine is."""
    monkeypatch.setattr("mitex.cli.display.FIRST_LINE", math.inf)
