"""Slurm's engine, on submitit's stand-in for one machine."""

import os
import signal
import sys

import pytest

from mitex.batch.engines import WorkerLost
from mitex.batch.engines.slurm import MOST_RETURNS, Slurm, _Queued
from mitex.errors import ConfigError, MissingPackage, RuntimeUnavailable

STEPS = 8


def test_a_job_that_has_to_give_way_comes_back_and_goes_on(workshop, wait_for, monkeypatch):
    """As Slurm does before it ends a job, submitit's process gets its signal."""
    monkeypatch.setenv("STRIPES_PACE", "0.15")
    plan = workshop.plan(("a.png",), steps=STEPS)

    def interrupt(event):
        if event.state == "submitted" and event.job.needs is None:
            wait_for(lambda: workshop.told("step"))
            claim = next((workshop.folder / "out").glob("jobs/fit-*/claim.0"))
            os.kill(int(claim.read_text().split(":")[1]), signal.SIGUSR2)

    report = workshop.run(plan, engine=Slurm(cluster="local"), on_event=interrupt)
    assert report.count("done") == 2
    assert workshop.told("start").count("fit-stripes-a") == 2
    assert workshop.told("step") == ["fit-stripes-a"] * STEPS
    assert workshop.files() == workshop.undisturbed(plan)


def test_options_are_those_of_sbatch(monkeypatch, tmp_path):
    """Of a machine that says that it has Slurm."""
    monkeypatch.setattr("submitit.slurm.slurm.SlurmExecutor.affinity", lambda *_: 2)
    executor = Slurm(["partition=cpu", "time=90"], threads=3)._opened(tmp_path)
    parameters = executor._executor.parameters
    assert (parameters["partition"], parameters["time"], parameters["cpus_per_task"]) == ("cpu", 90, 3)
    assert executor._executor.max_num_timeout == MOST_RETURNS
    with pytest.raises(ConfigError, match="submitit refuses"):
        Slurm(["partitoin=cpu"])._opened(tmp_path)


def test_lines_before_a_job(monkeypatch, tmp_path):
    monkeypatch.setattr("submitit.slurm.slurm.SlurmExecutor.affinity", lambda *_: 2)
    executor = Slurm(["setup=module load python"])._opened(tmp_path)._executor
    assert "\nmodule load python\n" in executor._make_submission_file_text("true", "uid")


@pytest.mark.parametrize("option", ["nodes=2", "ntasks-per-node=x"])
def test_a_job_is_one_process(option):
    with pytest.raises(ConfigError, match="a job is one process"):
        Slurm([option])


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    """Programs that stand in for those of a cluster; sbatch refuses all."""
    programs = tmp_path / "programs"
    programs.mkdir()
    for name in ("sbatch", "srun"):
        (programs / name).write_text("#!/bin/sh\necho sorry >&2\necho no such partition >&2\nexit 1\n")
        (programs / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(programs), prepend=os.pathsep)
    return programs


def test_what_slurm_refuses(workshop, cluster):
    with pytest.raises(RuntimeUnavailable, match=r"Slurm refuses a job \(no such partition\); mend"):
        workshop.run(workshop.plan(), engine=Slurm())
    assert not list((workshop.folder / "out" / "drivers").iterdir()) and workshop.told("start") == []


def test_options_are_checked_before_anything_is_written(workshop, cluster):
    with pytest.raises(ConfigError, match=r"refuses .* \(Unknown argument 'foo' .{,60}\); mend"):
        workshop.run(workshop.plan(), engine=Slurm(["foo=bar"]))
    assert not (workshop.folder / "out").exists()


def test_without_srun(workshop, cluster, monkeypatch):
    (cluster / "srun").unlink()
    with pytest.raises(RuntimeUnavailable, match="there is no srun here"):
        workshop.run(workshop.plan(), engine=Slurm())
    assert not (workshop.folder / "out").exists()


def test_without_submitit(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "submitit", None)
    with pytest.raises(MissingPackage, match=r"submitit.*; run `pip install 'mitex\[cluster\]'`"):
        Slurm()._opened(tmp_path)


def test_without_slurm(workshop):
    with pytest.raises(RuntimeUnavailable, match="there is no sbatch here"):
        workshop.run(workshop.plan(), engine=Slurm())
    assert not (workshop.folder / "out").exists()
    assert workshop.told("start") == []


@pytest.mark.parametrize("kind", ["FailedJobError", "UncompletedJobError"])
@pytest.mark.parametrize(("said", "reason"), [("it was\nkilled\n", "killed"), ("", "it says nothing")])
def test_a_job_that_is_lost(kind, said, reason):
    """Its last line says why."""
    submitit = pytest.importorskip("submitit")

    class Job:
        job_id = "77_0"

        def result(self):
            raise getattr(submitit.core.utils, kind)(said)

    with pytest.raises(WorkerLost, match=rf"job 77_0 of Slurm ended without a result \({reason}\)"):
        _Queued(Job()).result()
