"""SIGKILL at any moment loses at most the steps since the last checkpoint and corrupts nothing."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")


def _nursery(mode: str, folder: Path) -> dict:
    done = subprocess.run(
        [sys.executable, "-m", "tests.training.nursery", mode, str(folder)],
        cwd=Path(__file__).parents[2],
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_killed_at_random_moments(tmp_path):
    report = _nursery("random", tmp_path)
    assert report["kills"] >= 20
    assert report["leftovers"] > 0  # some kills did hit the writing of a checkpoint


def test_killed_at_every_access_to_the_file_system(tmp_path):
    assert _nursery("everywhere", tmp_path)["kills"] > 30
