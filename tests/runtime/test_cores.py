"""Free cores, and threads that follow them."""

import pytest
import torch

from mitex.runtime import cores
from mitex.runtime.cores import FollowingThreads, Usage, following_threads


class Machine:
    """Four cores of which others use some, and a process that uses one of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch):
        self.time = self.others = 0.0
        monkeypatch.setattr(cores, "cores", lambda: 4.0)
        monkeypatch.setattr(Usage, "now", self.now)
        monkeypatch.setattr(cores.time, "monotonic", lambda: self.time)
        monkeypatch.setattr(cores.workers, "is_set", lambda: False)
        monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
        torch.set_num_threads(4)

    def now(self) -> Usage:
        return Usage(self.time, self.others + self.time, self.time)

    def run(self, seconds: float, others: float) -> None:
        self.time += seconds
        self.others += others * seconds


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Machine:
    return Machine(monkeypatch)


def test_threads_follow_the_cores_that_others_leave(machine: Machine):
    with following_threads() as threads:
        counts = []
        for others in (0.0, 1.1, 3.0, 7.0, 0.4):
            machine.run(cores.SPACING + 1, others)
            threads.look()
            counts.append(torch.get_num_threads())
        assert counts == [4, 3, 1, 1, 4]
        machine.run(cores.SPACING - 1, 4.0)  # too short to tell
        threads.look()
        assert torch.get_num_threads() == 4
        machine.run(2.0, 4.0)
        threads.look()
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == 4


@pytest.mark.parametrize("how", ["threads", "environment"])
def test_a_number_that_the_user_has_set_stays(machine: Machine, monkeypatch: pytest.MonkeyPatch, how):
    if how == "threads":
        monkeypatch.setattr(cores.workers, "is_set", lambda: True)
    else:
        monkeypatch.setenv("OMP_NUM_THREADS", "4")
    threads = FollowingThreads()
    machine.run(60, 4.0)
    threads.look()
    assert torch.get_num_threads() == 4


def test_usage_of_the_cores_that_we_may_use(tmp_path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cores, "STAT", tmp_path / "stat")
    monkeypatch.setattr(cores.os, "sched_getaffinity", lambda process: {0, 2}, raising=False)
    monkeypatch.setattr(cores.os, "sysconf", lambda name: 100)
    rows = [
        "cpu 9 9 9 9 9 9 9 9 9 9",
        "cpu0 100 0 50 700 30 0 0 20 5 0",
        "cpu1 999 0 0 0 0 0 0 0 0 0",
        "cpu2 0 0 30 1 1 0 0 0 0 0",
        "intr 1 2 3",
    ]
    (tmp_path / "stat").write_text("\n".join(rows))
    usage = Usage.now()
    assert usage is not None and usage.everybody == pytest.approx(2.0)
    monkeypatch.setattr(cores, "STAT", tmp_path / "none")
    assert Usage.now() is None and cores.free_cores(0) is None


@pytest.mark.parametrize(
    ("quota", "count"), [("50000 100000", 0.5), ("max 100000", 3.0), ("900000 100000", 3.0)]
)
def test_cores_of_a_container(tmp_path, monkeypatch: pytest.MonkeyPatch, quota: str, count: float):
    monkeypatch.setattr(cores, "QUOTA", tmp_path / "cpu.max")
    monkeypatch.setattr(cores.os, "sched_getaffinity", lambda process: {0, 1, 5}, raising=False)
    (tmp_path / "cpu.max").write_text(quota)
    assert cores.cores() == count
