"""Doing one job on whichever machine: claim it, run its command, watch it, write down how it ended."""

from __future__ import annotations

import json
import re
import shutil
import signal
import socket
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from mitex.batch.claims import Claim
from mitex.batch.folder import DONE, FAILED, LOG, STARTS, BatchFolder
from mitex.batch.jobs import Job
from mitex.batch.process import Process, environment
from mitex.paths import writing
from mitex.runtime.signals import signal_name
from mitex.training.locate import METRICS, checkpoints

HEARTBEAT = 0.5  # between two looks at claim and driver [s]
RETRIES = 3  # of a job that a signal ended
INTERRUPTED = 130  # exit code

State = Literal["done", "failed", "interrupted", "elsewhere"]


@dataclass(frozen=True)
class Outcome:
    """How a task ended.

    Attributes:
        state: "elsewhere" if another process works on the job.
        record: what is written down of a job that is done or failed.
    """

    state: State
    record: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Task:
    """A job to be done by whoever calls this, which an engine may send to another machine.

    Attributes:
        job: the job.
        folder: of the batch.
        driver: name of the command that wants it; the job stops when that is dismissed.
        threads: of the job's process.
    """

    job: Job
    folder: BatchFolder
    driver: str
    threads: int

    def __call__(self) -> Outcome:
        """Does the job, unless it is done or another process is at it; returns when its process has ended.

        Raises:
            OutputError: The batch folder cannot be read or written to.
        """
        place = self.folder.of(self.job)
        with writing(place):
            if record := self.folder.done(self.job):
                return Outcome("done", record)
            place.mkdir(parents=True, exist_ok=True)
            claim = Claim.take(place)
        if claim is None:
            return Outcome("elsewhere")
        with writing(place), claim:
            if record := self.folder.done(self.job):  # since the first look
                return Outcome("done", record)
            if record := self.folder.failed(self.job):
                return Outcome("failed", record)
            return self._attempts(claim)

    def _attempts(self, claim: Claim) -> Outcome:
        """Runs the command, again after a signal from outside, until it ends or the driver wants no more."""
        reason = "its machine or its worker ended while it ran"
        while self.folder.has_driver(self.driver):
            checkpoint_time = self._checkpoint_time()
            start = self.folder.start(self.job, self.driver, checkpoint_time)
            if start["count"] > 1 + RETRIES:
                return self._failure(f"started {1 + RETRIES} times; {reason}")
            try:
                code, memory = self._run(claim, checkpoint_time is not None)
            except SystemExit:  # of the engine: Slurm wants the machine back
                self._write_stop(start)
                raise
            start["memory"] = max(start["memory"], memory)
            if code == 0:
                return self._success(start)
            if code == INTERRUPTED:
                self._write_stop(start)
                break
            self.folder.write(self.job, STARTS, start)
            if code > 0:
                return self._failure(_last_error(self.folder.of(self.job) / LOG), code)
            reason = f"ended by {signal_name(-code)}"
            reason += ", out of memory?" if code == -signal.SIGKILL else ""
        return Outcome("interrupted")

    def _write_stop(self, start: dict[str, Any]) -> None:
        """Writes down an attempt that was told to stop, and so does not count as a crash."""
        self.folder.write(self.job, STARTS, start | {"count": start["count"] - 1})

    def _checkpoint_time(self) -> float | None:
        """When the checkpoint was written that the job goes on from; None if it begins anew."""
        files = checkpoints(self.folder.result(self.job)) if self.job.resumed else []
        return max((file.stat().st_mtime for file in files), default=None)

    def _run(self, claim: Claim, resumes: bool) -> tuple[int, int]:
        """Exit code and memory of the job's command, which begins anew without what an earlier one left."""
        if not resumes:
            shutil.rmtree(self.folder.result(self.job), ignore_errors=True)
        words = self.job.resumed if resumes else self.job.words
        with (self.folder.of(self.job) / LOG).open("wb") as log:
            process = Process(words, self.folder.path, log, environment(self.threads))
            with _running(process), self._watched(process, claim):
                claim.note(process.pid)
                return process.wait()

    @contextmanager
    def _watched(self, process: Process, claim: Claim) -> Iterator[None]:
        """Keeps the claim, and stops the process when the claim is lost or the driver wants it."""
        ended = threading.Event()

        def watch() -> None:
            while not ended.wait(HEARTBEAT):
                if not claim.touch() or not self.folder.has_driver(self.driver):
                    process.stop()
                    while not ended.wait(HEARTBEAT):
                        claim.touch()

        watcher = threading.Thread(target=watch, daemon=True)
        watcher.start()
        try:
            yield
        finally:
            ended.set()
            watcher.join()

    def _success(self, start: Mapping[str, Any]) -> Outcome:
        record = {
            "time": time.strftime("%Y-%m-%dT%H:%M:%S%z", time.localtime(start["time"])),
            "seconds": round(start["seconds"] + time.time() - start["time"], 3),
            "memory": start["memory"],
            "host": socket.gethostname(),
            "metrics": _last_metrics(self.folder.result(self.job) / METRICS),
        }
        self.folder.forget_failure(self.job)
        self.folder.write(self.job, DONE, record)
        return Outcome("done", record)

    def _failure(self, error: str, code: int | None = None) -> Outcome:
        record = {"error": error, "code": code, "host": socket.gethostname()}
        self.folder.write(self.job, FAILED, record)
        return Outcome("failed", record)


_processes: set[Process] = set()  # those that run for this one


def stop_processes(number: int = signal.SIGTERM) -> None:
    """Sends a signal to the processes of all jobs that are done here and now."""
    for process in tuple(_processes):
        process.stop(number)


def end_processes() -> None:
    """Lets those processes save what they can, and waits for their end; may be called by a signal handler."""
    stop_processes()
    for process in tuple(_processes):
        with suppress(ChildProcessError):  # it has ended
            process.await_end()


@contextmanager
def _running(process: Process) -> Iterator[None]:
    """While the context lasts the process may run; it does not survive it."""
    _processes.add(process)
    try:
        yield
    except BaseException:
        process.stop()
        process.wait()
        raise
    finally:
        _processes.discard(process)


def _last_error(log: Path) -> str:
    """The line with which a command ended: that of the error, or else the last one."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", log.read_text(encoding="utf-8", errors="replace"))
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    return (errors or lines or ["it said nothing"])[-1]


def _last_metrics(file: Path) -> dict[str, Any]:
    """The last line of a run's metrics; nothing where there are none."""
    try:
        record = json.loads(file.read_bytes().rstrip(b"\n").rpartition(b"\n")[2])
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}
