"""Real clusters of two workers, of which one dies, or whose scheduler does."""

import os
import signal
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from mitex.batch import Event, status
from mitex.batch.engines.dask_cluster import NO_LIMIT, Dask
from mitex.errors import MissingPackage, RuntimeUnavailable
from mitex.runtime.cores import cores
from tests.batch.in_this_process import InThisProcess

CLUSTER = """
import time
from distributed import LocalCluster
cluster = LocalCluster(2, threads_per_worker=1, dashboard_address=None, memory_limit=0)
print(cluster.scheduler_address, flush=True)
time.sleep(1000)
"""
STEPS = 8


@pytest.fixture
def plan(workshop, monkeypatch):
    monkeypatch.setenv("STRIPES_PACE", "0.15")
    return workshop.plan(steps=STEPS)


def check_all_is_there(workshop, plan):
    """No step was done twice, and the files are those of a serial run."""
    assert status(workshop.folder / "out").count("done") == 4
    assert sorted(workshop.told("step")) == sorted(["fit-stripes-a", "fit-stripes-b"] * STEPS)
    assert workshop.files() == workshop.undisturbed(plan)


def when_both_run(workshop, wait_for, action):
    """An `on_event` that does something when two fits have done a step each."""
    submitted = []

    def on_event(event: Event):
        submitted.append(event.job.name)
        if len(submitted) == 2:
            wait_for(lambda: len(set(workshop.told("step"))) == 2)
            action()

    return on_event


def test_a_worker_is_killed(workshop, plan, wait_for):
    """The fit that it was at goes on from its checkpoint, with another worker."""

    def kill():
        claim = next((workshop.folder / "out").glob("jobs/fit-stripes-a-*/claim.0"))
        os.kill(int(claim.read_text().split(":")[1]), signal.SIGKILL)

    on_event = when_both_run(workshop, wait_for, kill)
    report = workshop.run(plan, engine=Dask(jobs=2), on_event=on_event)
    assert report.count("done") == 4
    assert workshop.told("start").count("fit-stripes-a") == 2
    check_all_is_there(workshop, plan)


def test_the_scheduler_is_killed(workshop, plan, wait_for, monkeypatch):
    """One line says so; another call, here without a cluster, does the rest."""
    cluster = subprocess.Popen([sys.executable, "-c", CLUSTER], stdout=subprocess.PIPE, text=True)
    assert cluster.stdout
    with cluster, Dask(cluster.stdout.readline().strip()) as engine:
        assert engine.threads == max(1, int(cores() // 2)) and engine.at_once is None
        on_event = when_both_run(workshop, wait_for, cluster.kill)
        with pytest.raises(RuntimeUnavailable, match="the Dask scheduler does not answer any more; start it"):
            workshop.run(plan, engine=engine, on_event=on_event)
    monkeypatch.delenv("STRIPES_PACE")
    monkeypatch.setattr("mitex.batch.task.Process", InThisProcess)
    assert workshop.run(plan).count("done") == 4
    check_all_is_there(workshop, plan)


def test_a_cluster_of_ours_bears_the_death_of_many_workers():
    """Dask counts it against all that the worker was to do, and would give up at the fourth."""
    engine: Any = Dask(jobs=1)
    engine._jobs = 0  # a scheduler alone starts at once
    with engine:
        assert engine._cluster.scheduler.allowed_failures == NO_LIMIT > 1000


@pytest.mark.parametrize(
    ("workers", "share"),
    [
        ([("a", 1, 8)], 8),
        ([("a", 1, 8), ("a", 3, 8)], 2),
        ([("a", 1, 8), ("a", 3, 8), ("b", 2, 12)], 2),
        ([("a", 1, 8), ("b", 4, 12), ("c", 1, 5)], 3),
        ([("a", 4, 2)], 1),
        ([("a", 2, 3.5)], 1),  # a container's quota
    ],
)
def test_tasks_share_the_cores_of_the_smallest_machine(workers, share):
    """Of workers with a host, tasks at a time and the host's cores, as a scheduler tells them."""
    told = {f"tcp://{host}:{number}": (host, tasks) for number, (host, tasks, _) in enumerate(workers)}
    answers = {name: count for name, (_, _, count) in zip(told, workers, strict=True)}
    left = {"tcp://gone:1": 1}  # ended between the two questions
    engine: Any = Dask("tcp://a:1")
    engine._client = SimpleNamespace(
        scheduler_info=lambda n_workers: {
            "workers": {name: {"host": host, "nthreads": tasks} for name, (host, tasks) in told.items()}
        },
        run=lambda function: answers | left if function is cores else {},
    )
    assert engine._share() == share


def test_without_dask(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingPackage, match=r"distributed.*; run `pip install 'mitex\[cluster\]'`"), Dask():
        pass
