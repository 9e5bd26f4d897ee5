"""What a job took: all attempts count that its result follows from, up to their checkpoints."""

import os
import shutil
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from mitex.batch.folder import BatchFolder
from mitex.batch.jobs import jobs_of
from mitex.batch.task import INTERRUPTED, RETRIES, Task
from mitex.training.locate import CHECKPOINT


@pytest.fixture
def scripted(monkeypatch):
    """Lets the attempts at a job go as a list says, by a clock of their own.

    Each is: seconds until its last checkpoint, or None without one; seconds until its end, exit code or what
    is raised, memory.
    """

    def go(*attempts):
        left, now = list(attempts), [1e9]
        clock = SimpleNamespace(time=lambda: now[0], strftime=time.strftime, localtime=time.localtime)

        class Scripted:
            pid = os.getpid()
            stopped = False

            def __init__(self, words, folder, *_):
                self.result = Path(folder, words[words.index("--out") + 1])

            def wait(self):
                if self.stopped:
                    return INTERRUPTED, 0
                saved, seconds, code, memory = left.pop(0)
                self.result.mkdir(parents=True, exist_ok=True)
                if saved is not None:
                    (self.result / CHECKPOINT).touch()
                    os.utime(self.result / CHECKPOINT, (now[0] + saved,) * 2)
                now[0] += seconds
                if isinstance(code, BaseException):
                    raise code
                return code, memory

            def stop(self):
                self.stopped = True

        monkeypatch.setattr("mitex.batch.task.Process", Scripted)
        for module in ("folder", "task"):
            monkeypatch.setattr(f"mitex.batch.{module}.time", clock)

    return go


LAST = (None, 20, 0, 5)
ENDS = {
    "nothing ended it": ([(10, 20, 0, 5)], 20, 5),
    "interrupted": ([(100, 100, INTERRUPTED, 9), LAST], 120, 9),
    "interrupted twice": ([(100, 100, INTERRUPTED, 5), (50, 50, INTERRUPTED, 9), LAST], 170, 9),
    "crashed after a checkpoint": ([(100, 130, -9, 9), LAST], 120, 9),
    "crashed, and again before the next one": ([(100, 130, -9, 9), (None, 70, -9, 5), LAST], 120, 9),
    "crashed without a checkpoint": ([(None, 130, -9, 9), LAST], 20, 5),
    "failed, and tried again": ([(100, 130, 2, 9), LAST], 120, 9),
}


@pytest.mark.parametrize("name", ENDS)
def test_attempts_add_up(name, workshop, scripted):
    attempts, seconds, memory = ENDS[name]
    plan = workshop.plan(("a.png",))
    scripted(*attempts, (None, 3, 0, 1))
    report = workshop.run(plan)
    while report.count("done") < 2:
        report = workshop.run(plan, retry=True)
    fit, apply = (row.record for row in report.rows)
    assert (fit["seconds"], fit["memory"]) == (seconds, memory)
    assert (apply["seconds"], apply["memory"]) == (3, 1)


def test_a_job_that_begins_again_is_no_longer_done(workshop, scripted):
    """Somebody has removed the results; the next attempt at the fit is interrupted after a checkpoint."""
    plan = workshop.plan(("a.png",))
    scripted(LAST, LAST, (100, 100, INTERRUPTED, 9), LAST, LAST)
    assert workshop.run(plan).count("done") == 2
    shutil.rmtree(workshop.folder / "out" / "results")
    assert workshop.run(plan).rows[0].state == "interrupted"
    assert [row.record["seconds"] for row in workshop.run(plan).rows] == [120, 20]


def test_an_attempt_that_was_told_to_stop_is_no_crash(workshop, scripted):
    """However often the engine wants the machine back; crashes among them still count."""
    (job, _) = jobs_of(workshop.plan(("a.png",)))
    folder = BatchFolder(workshop.folder / "out")
    returns = [(10, 20, SystemExit(-1), 5)] * (3 * RETRIES)
    with folder.driver([job]) as name:
        task = Task(job, folder, name, 1)
        scripted(*returns, (10, 20, -9, 5), LAST)
        for _ in returns:
            with pytest.raises(SystemExit):
                task()
        assert task().state == "done"
