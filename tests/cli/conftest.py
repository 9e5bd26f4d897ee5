"""Fixtures of the command line's tests."""

import pytest

from tests.cli import bad_files as bad


@pytest.fixture
def files(tmp_path, monkeypatch):
    """The working folder, with some good and bad files in it, and an empty `out`."""
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    bad.text(tmp_path / "good.obj", bad.CUBE)
    return tmp_path
