"""A folder with inputs and a plan for the methods of tests/batch/toy, whose fits take no time."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from mitex.batch import Plan, Report, run_plan
from mitex.methods.registry import methods
from tests.batch.in_this_process import InThisProcess

ROOT, TOY = Path(__file__).parents[2], Path(__file__).parent / "toy"
PATIENCE = 200.0  # with what happens at once on a machine that has nothing else to do [s]


@dataclass(frozen=True)
class Workshop:
    """A folder for one test.

    Attributes:
        folder: with a.png, b.png and m.obj, which are a few bytes each.
        log: what the toy's fits tell.
    """

    folder: Path
    log: Path

    def plan(self, exemplars: tuple[str, ...] = ("a.png", "b.png"), **fit: Any) -> Plan:
        """`stripes` from the exemplars, put on m.obj."""
        content = {
            "exemplars": list(exemplars),
            "meshes": ["m.obj"],
            "methods": {"stripes": {"steps": 2, **fit}},
        }
        return Plan.of(content, self.folder)

    def run(self, plan: Plan, out: str = "out", engine: Any = None, **options: Any) -> Report:
        return run_plan(plan, self.folder / out, engine, threads=1, **options)

    def undisturbed(self, plan: Plan) -> dict[str, bytes]:
        """What the jobs write that run one after the other, here and as fast as they can."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("mitex.batch.task.Process", InThisProcess)
            patch.delenv("STRIPES_PACE", raising=False)
            self.run(plan, "serial")
        return self.files("serial")

    def told(self, word: str, out: str = "") -> list[str]:
        """The jobs in the lines of the log that begin with a word."""
        lines = self.log.read_text().splitlines() if self.log.exists() else []
        return [line.split()[1].rpartition("-")[0] for line in lines if line.startswith(word)]

    def files(self, out: str = "out") -> dict[str, bytes]:
        """All that the jobs of a batch have written."""
        results = self.folder / out / "results"
        return {
            str(file.relative_to(results)): file.read_bytes() for file in results.rglob("*") if file.is_file()
        }


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The toy methods are installed, for jobs too."""
    monkeypatch.syspath_prepend(TOY)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(TOY)]))
    methods.cache_clear()
    yield
    methods.cache_clear()


@pytest.fixture
def workshop(toy: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workshop:
    """A folder for one test."""
    for name in ("a.png", "b.png", "m.obj"):
        (tmp_path / name).write_text(name)
    monkeypatch.setenv("STRIPES_LOG", str(tmp_path / "log"))
    return Workshop(tmp_path, tmp_path / "log")


@pytest.fixture
def wait_for() -> Callable[[Callable[[], Any]], Any]:
    """Waits until a call gives something, and gives that."""
    import time

    def wait(call: Callable[[], Any]) -> Any:
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if value := call():
                return value
            time.sleep(0.02)
        pytest.fail("it did not happen")

    return wait
