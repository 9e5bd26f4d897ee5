"""Running a plan: which job is next, what has ended, and stopping so that the next call goes on."""

from __future__ import annotations

import logging
import os
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from mitex.batch.engines import Engine, Handle, WorkerLost
from mitex.batch.engines.local import Local
from mitex.batch.folder import FAILED, BatchFolder
from mitex.batch.jobs import Job, jobs_of
from mitex.batch.plan import Plan
from mitex.batch.report import Report, report_of
from mitex.batch.task import RETRIES, Outcome, Task
from mitex.errors import OutputError
from mitex.progress import announce
from mitex.runtime.signals import StopSignals
from mitex.training.progress import clock

log = logging.getLogger(__name__)

RECHECK = 1.0  # between two looks at a job that another call works on [s]

EventState = Literal["submitted", "done", "failed", "interrupted", "elsewhere"]


@dataclass(frozen=True)
class Event:
    """Something that happened to a job.

    Attributes:
        job: the job.
        state: "submitted", or how it ended.
        record: of a job that is done or failed: see `BatchFolder`.
        ended: jobs that are done or failed so far.
        total: jobs in all.
    """

    job: Job
    state: EventState
    record: dict[str, Any]
    ended: int
    total: int


def run_plan(
    plan: Plan,
    folder: str | Path,
    engine: Engine | None = None,
    *,
    threads: int | None = None,
    retry: bool = False,
    on_event: Callable[[Event], None] | None = None,
) -> Report:
    """Does all jobs of a plan that are not done, and writes results.csv.

    Several calls may run on one folder, also of several machines: no job is done twice. A job that fails does
    not stop the others, but those that need its result.

    Args:
        plan: what is to be made.
        folder: new, empty, or that of an earlier call, which goes on.
        engine: where the jobs run; one after the other on this machine if None.
        threads: of each job; None leaves it to the engine.
        retry: whether jobs that failed in earlier calls are tried again.
        on_event: is told of each job that is submitted or ends, in the caller's thread.

    Returns:
        How far each job is.

    Raises:
        ConfigError: An input does not exist, or a job is there twice.
        OutputError: The folder holds other files, lies in an input, or cannot be written to.
        KeyboardInterrupt: Ctrl-C or SIGTERM; the fits that were running have saved their checkpoints.
    """
    jobs = jobs_of(plan)
    batch_folder = BatchFolder.checked(folder)
    _check_outside(batch_folder.path, jobs)
    with StopSignals() as signals, engine or Local() as workers, batch_folder.driver(jobs) as driver:
        if retry:
            for job in jobs:
                batch_folder.forget_failure(job)
        run = _Run(jobs, batch_folder, workers, driver, threads or workers.threads, on_event)
        is_complete = run.loop(signals)
    report = report_of(batch_folder, jobs)
    report.write_csv()
    if not is_complete:
        raise KeyboardInterrupt(
            f"interrupted with {report.count('done')} of {len(jobs)} jobs done; the same command goes on"
        )
    return report


def _check_outside(folder: Path, jobs: Sequence[Job]) -> None:
    """Refuses to write into a folder that is an input: its content, and so the jobs, would change."""
    for word in dict.fromkeys(word for job in jobs for word in job.words):
        is_input = os.path.isabs(word) and os.path.isdir(word)
        if is_input and folder.resolve().is_relative_to(Path(word).resolve()):
            raise OutputError(f"'{folder}' lies in the input '{word}'", "name a folder elsewhere with `out`")


@dataclass
class _Run:
    """One call of `run_plan`.

    Attributes:
        driver: name of this call in the folder.
        end_states: how the jobs ended that this call has nothing more to do with, by their ids.
        handles: tasks that were submitted, by the jobs' ids.
        losses: how many workers were lost with a job.
        not_before: when to look again at jobs that other calls work on.
    """

    jobs: Sequence[Job]
    folder: BatchFolder
    engine: Engine
    driver: str
    threads: int
    on_event: Callable[[Event], None] | None
    end_states: dict[str, str] = field(default_factory=dict)
    handles: dict[str, Handle] = field(default_factory=dict)
    losses: Counter[str] = field(default_factory=Counter)
    not_before: dict[str, float] = field(default_factory=dict)

    def loop(self, signals: StopSignals) -> bool:
        """Goes on until all jobs have ended; returns whether they have, or False if a signal came before."""
        for job in self.jobs:
            self._note_finished(job)
        self._announce()
        while len(self.end_states) < len(self.jobs):
            if signals.requested:
                self._stop()
                return False
            self._submit()
            self._collect()
            time.sleep(self.engine.pause)
        return True

    def _note_finished(self, job: Job) -> bool:
        """Takes note of a job that another call has finished; whether it has, as far as one can tell."""
        for state, look in (("done", self.folder.done), ("failed", self.folder.failed)):
            with suppress(OSError):  # a disk that is away for a moment; the task looks again
                if look(job):
                    self.end_states[job.id] = state
                    return True
        return False

    def _submit(self) -> None:
        """Submits the jobs that can begin, as many as the engine takes."""
        for job in self.jobs:
            if self.engine.at_once is not None and len(self.handles) >= self.engine.at_once:
                break
            if job.id in self.end_states or job.id in self.handles:
                continue
            needed_state = "done" if job.needs is None else self.end_states.get(job.needs)
            if needed_state == "done":
                self._begin(job)
            elif needed_state is not None:
                self.end_states[job.id] = "blocked"

    def _begin(self, job: Job) -> None:
        """Submits a job, unless another call works on it or has finished it."""
        now = time.monotonic()
        if now < self.not_before.get(job.id, 0.0) or self._note_finished(job):
            return
        if self._is_held(job):
            self.not_before[job.id] = now + RECHECK
            return
        self.handles[job.id] = self.engine.submit(Task(job, self.folder, self.driver, self.threads))
        self._report(job, "submitted", {})

    def _is_held(self, job: Job) -> bool:
        """Whether somebody works on the job; so it is taken if nobody can tell."""
        try:
            return self.folder.holder(job) is not None
        except OSError:  # a disk that is away for a moment
            return True

    def _collect(self) -> None:
        """Takes note of the tasks that have ended."""
        for job in self.jobs:
            if job.id in self.handles and self.handles[job.id].done():
                try:
                    self._note(job, self.handles.pop(job.id).result())
                except WorkerLost as loss:
                    self._note_loss(job, loss)

    def _note(self, job: Job, outcome: Outcome) -> None:
        """Takes note of how a task ended; a job that another call works on is looked at again later."""
        if outcome.state == "elsewhere":
            self.not_before[job.id] = time.monotonic() + RECHECK
            return
        self.end_states[job.id] = outcome.state
        self._report(job, outcome.state, outcome.record)

    def _note_loss(self, job: Job, loss: WorkerLost) -> None:
        """A job whose worker is gone is submitted again, but not for ever."""
        self.losses[job.id] += 1
        log.info("%s: %s", job.name, loss)
        if self.losses[job.id] > RETRIES:
            record = {"error": f"lost {self.losses[job.id]} workers; {loss}", "code": None}
            self.folder.write(job, FAILED, record)
            self._note(job, Outcome("failed", record))

    def _stop(self) -> None:
        """Takes back what has not begun, and waits for what has: fits save their checkpoints."""
        self.folder.dismiss(self.driver)
        for job in self.jobs:
            if job.id in self.handles and not self._is_held(job):
                self.handles.pop(job.id).cancel()
        while self.handles:
            self._collect()
            time.sleep(self.engine.pause)

    def _report(self, job: Job, state: EventState, record: dict[str, Any]) -> None:
        """Lets the log, `on_event` and the progress display know of an event."""
        count = len(self.end_states)
        if state == "done":
            log.info("%s: done in %s", job.name, clock(record.get("seconds", 0)))
        elif state != "submitted":
            log.info("%s: %s", job.name, record.get("error", state))
        if self.on_event:
            self.on_event(Event(job, state, record, count, len(self.jobs)))
        self._announce()

    def _announce(self) -> None:
        announce("running jobs", len(self.end_states), len(self.jobs))
