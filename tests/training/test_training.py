"""Training as a whole."""

import subprocess
import sys
from pathlib import Path

import pytest

import mitex.training

ROOT = Path(__file__).parents[2]


def test_every_public_name_is_there():
    for name in mitex.training.__all__:
        assert getattr(mitex.training, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'trian'"):
        mitex.training.__getattr__("trian")


def test_configs_and_errors_do_not_load_torch():
    code = "import sys; from mitex.training import Interrupted, resolve; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 0


def test_training_does_not_load_the_compiler_or_mitsuba():
    code = """
import sys, tempfile
from mitex.training import train
from tests.training.task import SmallConfig, SmallTask
with tempfile.TemporaryDirectory() as out:
    train(SmallTask(), SmallConfig(), out, lr=0.1)
sys.exit(len({'torch._dynamo', 'mitsuba', 'drjit'} & set(sys.modules)))
"""
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 0
