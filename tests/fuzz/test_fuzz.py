"""Whatever happens to a file, its loader reads it or refuses it in one line, in little time and memory."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.loaders import LOADERS

ROOT = Path(__file__).parents[2]
BATCH = 2000  # cases of a process
CACHES = ("cache", "manifest")  # what is damaged in them is computed again


def reports(loader: str, first: int, count: int) -> list[dict]:
    """What a process of its own says that reads damaged files."""
    process = subprocess.run(
        [sys.executable, "-m", "tests.fuzz.run", loader, str(first), str(count)],
        cwd=ROOT,
        env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MITEX_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stdout[-500:] + process.stderr[-2000:]
    return [json.loads(line) for line in process.stdout.splitlines()]


def check(report: dict, count: int) -> None:
    assert not report["faults"], (report["loader"], report["faults"][0])
    assert report["read"] + report["refused"] == count
    assert report["refused"] > 0 or report["loader"] in CACHES


def test_every_loader_500_times():
    results = reports("all", 0, 500)
    assert [report["loader"] for report in results] == list(LOADERS)
    for report in results:
        check(report, 500)


@pytest.mark.slow
@pytest.mark.parametrize("loader", LOADERS)
def test_20_000_times(loader):
    for first in range(0, 20_000, BATCH):
        for report in reports(loader, first, BATCH):
            check(report, BATCH)
