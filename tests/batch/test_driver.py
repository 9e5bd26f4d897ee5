"""Running plans on one machine: what is done stays done, whatever ends in between."""

import errno
import json
import os
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import ClassVar

import pytest

from mitex.batch import Event, status
from mitex.batch.claims import Claim
from mitex.batch.engines import WorkerLost
from mitex.batch.engines.local import Local
from mitex.batch.folder import BatchFolder
from mitex.batch.jobs import jobs_of
from mitex.batch.task import RETRIES, Outcome, Task
from mitex.cli import main
from mitex.errors import OutputError
from mitex.runtime import cores
from tests.batch.in_this_process import InThisProcess

PLAN = """exemplars = ["a.png", "b.png"]
meshes = ["m.obj"]
[methods.stripes]
steps = 6
"""
PACE = "0.15"  # of the steps that are interrupted [s]


@pytest.fixture
def driver(workshop, monkeypatch):
    """Starts `mitex batch` in a process of its own, on two slow fits and what needs them."""
    (workshop.folder / "plan.toml").write_text(PLAN)
    monkeypatch.setenv("STRIPES_PACE", PACE)
    processes = []

    def start(*words):
        command = [
            sys.executable,
            "-m",
            "mitex",
            "batch",
            "plan.toml",
            "--out",
            "out",
            "--threads",
            "1",
            *words,
        ]
        processes.append(subprocess.Popen(command, cwd=workshop.folder, stderr=subprocess.PIPE, text=True))
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.communicate()


@pytest.fixture
def in_this_process(monkeypatch):
    """For tests of what a driver does between jobs."""
    monkeypatch.setattr("mitex.batch.task.Process", InThisProcess)


class TestOneAfterTheOther:
    def test_all_is_done_once_and_told(self, workshop, in_this_process):
        events: list[Event] = []
        report = workshop.run(workshop.plan(), on_event=events.append)
        assert report.count("done") == len(report.rows) == 4
        starts = workshop.told("start")
        assert starts == [
            *("fit-stripes-a", "apply-stripes-a-m"),
            *("fit-stripes-b", "apply-stripes-b-m"),
        ]
        assert [(event.job.name, event.state) for event in events] == [
            (name, state) for name in starts for state in ("submitted", "done")
        ]
        assert [event.ended for event in events] == [0, 1, 1, 2, 2, 3, 3, 4]

    def test_again_nothing_is_done(self, workshop, in_this_process):
        first = workshop.run(workshop.plan())
        events = []
        assert workshop.run(workshop.plan(), on_event=events.append) == first
        assert len(workshop.told("start")) == 4 and events == []

    def test_a_larger_plan_goes_on(self, workshop, in_this_process):
        workshop.run(workshop.plan(("a.png",)))
        report = workshop.run(workshop.plan())
        assert report.count("done") == 4 and len(workshop.told("start")) == 4

    def test_the_report_is_of_ones_own_plan(self, workshop):
        """Another command with another plan has begun on the folder meanwhile."""
        once = []

        def begin_another(event: Event):
            if not once:
                once.append(event)
                workshop.run(workshop.plan(("b.png",)))

        report = workshop.run(workshop.plan(("a.png",)), on_event=begin_another)
        assert [row.job.name for row in report.rows] == ["fit-stripes-a", "apply-stripes-a-m"]
        assert status(report.folder).rows[0].job.name == "fit-stripes-b"

    def test_a_result_that_is_gone_is_made_again(self, workshop, in_this_process):
        report = workshop.run(workshop.plan(("a.png",)))
        before = workshop.files()
        (file,) = (report.folder / report.rows[1].job.result).iterdir()
        file.unlink()
        file.parent.rmdir()
        workshop.run(workshop.plan(("a.png",)))
        assert workshop.told("start")[2:] == ["apply-stripes-a-m"] and workshop.files() == before

    def test_what_is_written_down(self, workshop):
        report = workshop.run(workshop.plan(("a.png",)))
        fit, apply = (BatchFolder(report.folder).of(row.job) / "done.json" for row in report.rows)
        record = json.loads(fit.read_text())
        assert record["metrics"] == {"step": 2, "loss": 0.5} and record["memory"] > 1e6
        assert record["seconds"] > 0 and record["host"] and record["time"][:2] == "20"
        assert json.loads(apply.read_text())["metrics"] == {}
        lines = (report.folder / "results.csv").read_text().splitlines()
        assert lines[0].endswith("host,result,last_loss,last_step") and lines[1].endswith(",0.5,2")
        assert not list(report.folder.rglob("claim*")) and not list((report.folder / "drivers").iterdir())

    @pytest.mark.parametrize(("quota", "threads"), [("50000 100000", 1), ("250000 100000", 2)])
    def test_threads_within_the_quota_of_a_container(self, tmp_path, monkeypatch, quota, threads):
        monkeypatch.setattr(cores, "QUOTA", tmp_path / "cpu.max")
        monkeypatch.setattr(cores.os, "sched_getaffinity", lambda process: set(range(8)), raising=False)
        (tmp_path / "cpu.max").write_text(quota)
        assert Local(1).threads == threads

    def test_threads_are_shared(self, workshop):
        assert Local(1).threads == max(1, int(cores.cores())) and Local(10_000).threads == 1
        workshop.run(workshop.plan(("a.png",)))
        assert workshop.log.read_text().splitlines()[0].split()[2] == "1"

    @pytest.mark.parametrize("link", [False, True])
    def test_results_in_an_input_are_refused(self, workshop, link):
        """They would make it another one."""
        (workshop.folder / "look").mkdir()
        (workshop.folder / "look" / "albedo.png").write_text("a")
        (workshop.folder / "link").symlink_to("look")
        before = sorted(workshop.folder.rglob("*"))
        with pytest.raises(OutputError, match="/out' lies in the input '.*/look'; name a folder elsewhere"):
            workshop.run(workshop.plan(("look",)), "link/out" if link else "look/out")
        assert sorted(workshop.folder.rglob("*")) == before and workshop.told("start") == []


class TestFailures:
    def test_a_poisoned_exemplar_fails_alone(self, workshop, capsys):
        (workshop.folder / "p.png").write_text("poison")
        plan = workshop.plan(("p.png", "a.png"))
        report = workshop.run(plan)
        assert [row.state for row in report.rows] == ["failed", "blocked", "done", "done"]
        (failure,) = report.failures
        assert failure.record["code"] == 2 and "p.png' is poisoned" in failure.record["error"]
        assert workshop.told("start").count("fit-stripes-p") == 1

        assert main(["batch", "status", str(report.folder)]) == 0
        printed = capsys.readouterr().out
        assert printed.startswith("4 jobs: 2 done, 1 failed, 1 blocked\n")
        assert "failed   fit-stripes-p: " in printed and "poisoned; take another one\n" in printed

        workshop.run(plan)
        assert workshop.told("start").count("fit-stripes-p") == 1
        workshop.run(plan, retry=True)
        assert workshop.told("start").count("fit-stripes-p") == 2

        assert workshop.files() == workshop.undisturbed(workshop.plan(("a.png",)))

    def test_a_crash_is_tried_again_a_few_times(self, workshop):
        (workshop.folder / "c.png").write_text("crash")
        report = workshop.run(workshop.plan(("c.png",)))
        assert [row.state for row in report.rows] == ["failed", "blocked"]
        assert "SIGKILL" in report.rows[0].record["error"]
        assert workshop.told("start") == ["fit-stripes-c"] * (1 + RETRIES)

    def test_at_the_command_line(self, workshop, monkeypatch, capsys):
        (workshop.folder / "p.png").write_text("poison")
        (workshop.folder / "plan.toml").write_text('exemplars = ["p.png"]\n[methods.stripes]')
        monkeypatch.chdir(workshop.folder)
        assert main(["batch", "plan.toml", "--out", "out", "--quiet"]) == 2
        printed = capsys.readouterr()
        assert printed.err.startswith("error: 1 of 1 jobs are not done; ")
        assert printed.out.splitlines()[-1] == "out" and "failed   fit-stripes-p" in printed.out

    def test_a_bug_is_told_by_its_last_line(self, workshop, monkeypatch):
        monkeypatch.delenv("STRIPES_LOG")
        report = workshop.run(workshop.plan(("a.png",)))
        assert report.failures[0].record == {
            **report.failures[0].record,
            "error": "KeyError: 'STRIPES_LOG'",
            "code": 1,
        }

    def test_a_full_disk_stops_all(self, workshop, monkeypatch):
        """Also the job that runs. With space again, the same call goes on."""

        def refuse(claim, pid):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        with monkeypatch.context() as patch, pytest.raises(OutputError, match="no space left"):
            patch.setattr(Claim, "note", refuse)
            workshop.run(workshop.plan(steps=1000))
        assert not list(workshop.folder.rglob("claim*"))
        monkeypatch.setattr("mitex.batch.task.Process", InThisProcess)
        assert workshop.run(workshop.plan()).count("done") == 4

    @pytest.mark.parametrize("losses", [RETRIES, RETRIES + 1])
    def test_lost_workers(self, losses, workshop, in_this_process):
        class Fragile(Local):
            left = losses

            def submit(self, task):
                if not self.left:
                    return super().submit(task)
                self.left -= 1
                return Lost()

        class Lost:
            def done(self):
                return True

            def result(self) -> Outcome:
                raise WorkerLost("its worker died")

        report = workshop.run(workshop.plan(("a.png",)), engine=Fragile())
        states = ["done", "done"] if losses == RETRIES else ["failed", "blocked"]
        assert [row.state for row in report.rows] == states


class TestADiskThatIsAwayForAMoment:
    """As one of a network is: calls fail with an error that says nothing of the file."""

    def test_a_job_goes_on_and_still_stops_when_it_is_told_to(self, workshop, wait_for, monkeypatch):
        monkeypatch.setenv("STRIPES_PACE", PACE)
        (job, _) = jobs_of(workshop.plan(("a.png",), steps=100))
        folder, errors = BatchFolder(workshop.folder / "out"), []
        with folder.driver([job]) as name, ThreadPoolExecutor(1) as pool:
            outcome = pool.submit(Task(job, folder, name, 1))
            wait_for(lambda: workshop.told("step"))
            with monkeypatch.context() as patch:
                patch.setattr(Path, "stat", stale("drivers", errors))
                wait_for(lambda: len(errors) > 1)
            folder.dismiss(name)
            assert outcome.result().state == "interrupted"

    @pytest.mark.parametrize("look", ["done", "failed", "holder"])
    def test_a_command_looks_again(self, look, workshop, in_this_process, monkeypatch):
        errors, real = [], getattr(BatchFolder, look)

        def looked(folder, job):
            if threading.current_thread() is threading.main_thread() and len(errors) < 3:
                errors.append(job)
                raise OSError(errno.ESTALE, os.strerror(errno.ESTALE))
            return real(folder, job)

        monkeypatch.setattr(BatchFolder, look, looked)
        monkeypatch.setattr("mitex.batch.driver.RECHECK", 0.01)
        assert workshop.run(workshop.plan(("a.png",))).count("done") == 2
        assert len(errors) == 3 and len(workshop.told("start")) == 2

    def test_a_finished_job_is_not_done_again(self, workshop, in_this_process, monkeypatch):
        report = workshop.run(workshop.plan(("a.png",)))
        monkeypatch.setattr(Path, "stat", stale("results", []))
        with pytest.raises(OutputError, match="Stale file handle"):
            workshop.run(workshop.plan(("a.png",)))
        with pytest.raises(OutputError, match=r"cannot read .* \(Stale file handle\); try again later"):
            status(report.folder)
        assert len(workshop.told("start")) == 2


def stale(folder, errors):
    """`Path.stat` that fails, and notes that, for what is in a folder of this name."""
    real = Path.stat

    def stat(path, **options):
        if folder in path.parts:
            errors.append(path)
            raise OSError(errno.ESTALE, os.strerror(errno.ESTALE))
        return real(path, **options)

    return stat


class TestInterruptions:
    """The other jobs' files are those of a run that nothing interrupted, and no step is done twice."""

    undisturbed: ClassVar[dict[str, bytes]] = {}  # the files of that run, for all tests

    def check_the_rest(self, workshop, patch):
        """Another call, in this process, does what is left."""
        patch.delenv("STRIPES_PACE", raising=False)
        patch.setattr("mitex.batch.task.Process", InThisProcess)
        workshop.run(workshop.plan(steps=6))
        assert sorted(workshop.told("step")) == sorted(["fit-stripes-a", "fit-stripes-b"] * 6)
        assert status(workshop.folder / "out").count("done") == 4
        if not self.undisturbed:
            self.undisturbed.update(workshop.undisturbed(workshop.plan(steps=6)))
        assert workshop.files() == self.undisturbed

    def check_the_time(self, workshop):
        """The steps before the interruption count."""
        for row in status(workshop.folder / "out").rows[::2]:
            starts = BatchFolder(workshop.folder / "out").of(row.job) / "starts.json"
            assert row.record["seconds"] > json.loads(starts.read_text())["seconds"] > float(PACE)

    def test_sigterm(self, workshop, driver, wait_for, monkeypatch):
        process = driver("--jobs", "2")
        wait_for(lambda: len(set(workshop.told("step"))) == 2)
        process.send_signal(signal.SIGTERM)
        assert process.wait(200) == 130
        assert "interrupted with 0 of 4 jobs done; the same command goes on" in process.stderr.read()
        assert not list((workshop.folder / "out").rglob("claim*"))
        states = [row.state for row in status(workshop.folder / "out").rows]
        assert states == ["interrupted", "waiting"] * 2
        monkeypatch.delenv("STRIPES_PACE")
        assert driver("--quiet").wait(200) == 0
        assert status(workshop.folder / "out").count("done") == 4
        self.check_the_rest(workshop, monkeypatch)
        self.check_the_time(workshop)

    def test_a_second_signal_does_not_wait_for_a_step(self, workshop, driver, wait_for, monkeypatch):
        monkeypatch.setenv("STRIPES_PACE", "1000")
        process = driver()
        wait_for(lambda: workshop.told("start"))
        process.send_signal(signal.SIGTERM)
        wait_for(lambda: "stopping" in process.stderr.readline())
        process.send_signal(signal.SIGTERM)
        assert process.wait(200) == 130 and not workshop.told("step")

    @pytest.mark.parametrize("engine", ["local", "dask"])
    def test_the_driver_is_killed(self, engine, workshop, driver, wait_for, monkeypatch):
        """Its fits save their checkpoints. The next call waits until they have ended."""
        process = driver("--jobs", "2", "--engine", engine)
        wait_for(lambda: len(set(workshop.told("step"))) == 2)
        process.kill()
        process.wait(200)
        self.check_the_rest(workshop, monkeypatch)
        self.check_the_time(workshop)

    def test_a_job_that_someone_else_interrupts(self, workshop, wait_for, monkeypatch):
        monkeypatch.setenv("STRIPES_PACE", PACE)
        plan = workshop.plan(("a.png",), steps=50)
        with ThreadPoolExecutor(1) as pool:
            report = pool.submit(workshop.run, plan)
            wait_for(lambda: workshop.told("step"))
            os.kill(int(next(workshop.folder.rglob("claim.0")).read_text().split(":")[-3]), signal.SIGTERM)
            assert [row.state for row in report.result().rows] == ["interrupted", "waiting"]

    @pytest.mark.parametrize("engine", ["local", "dask"])
    def test_two_drivers(self, engine, workshop, driver, monkeypatch):
        processes = [driver("--quiet", "--jobs", "2", "--engine", engine) for _ in range(2)]
        assert [process.wait(200) for process in processes] == [0, 0]
        assert sorted(workshop.told("start")) == sorted(set(workshop.told("start")))
        self.check_the_rest(workshop, monkeypatch)
