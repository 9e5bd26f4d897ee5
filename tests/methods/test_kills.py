"""SIGKILL of the real command, whichever method: nothing is lost past a checkpoint, and no result is half."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.methods.fits import FITS

ROOT = Path(__file__).parents[2]
METHODS = [name for name in FITS if name != "checkerboard"]


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_killed_again_and_again(tmp_path, method):
    count = 100 if method == "nca" else 30
    done = subprocess.run(
        [sys.executable, "-m", "tests.methods.kills", method, str(count), str(tmp_path)],
        cwd=ROOT,
        env=os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert sum(json.loads(done.stdout.splitlines()[-1]).values()) == count
