"""The batch folder: its jobs, and how far each of them is.

plan.jsonl         the jobs, one a line
results/ID/        what a job writes: a run folder, or an asset
jobs/ID/done.json  time, seconds, memory, metrics and host of a job that is done
jobs/ID/failed.json, log.txt, claim.N
jobs/ID/starts.json  how often it was started, and what the attempts took that the last one goes on from
drivers/NAME       of a command that is running; its jobs stop when the file is gone
"""

from __future__ import annotations

import json
import os
import secrets
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mitex.batch import claims
from mitex.batch.jobs import Job
from mitex.errors import ConfigError
from mitex.paths import atomic_write, check_own_folder, expanded, writing
from mitex.records import write_json

PLAN = "plan.jsonl"
DONE, FAILED, STARTS, LOG = "done.json", "failed.json", "starts.json", "log.txt"


@dataclass(frozen=True)
class BatchFolder:
    """A folder with the jobs of a plan.

    Attributes:
        path: absolute.
    """

    path: Path

    @staticmethod
    def checked(out: str | Path) -> BatchFolder:
        """A new or empty folder, or one of an earlier call; nothing is written.

        Raises:
            OutputError: It holds other files, or cannot be written to.
        """
        return BatchFolder(check_own_folder(out, lambda folder: BatchFolder(folder).is_ours()))

    @staticmethod
    def existing(path: str | Path) -> BatchFolder:
        """A folder that `mitex batch` has written.

        Raises:
            ConfigError: It is none.
        """
        folder = BatchFolder(Path(os.path.abspath(expanded(path))))
        if not folder.is_ours():
            raise ConfigError(f"'{path}' is no folder of `mitex batch`", "name what it was given as `out`")
        return folder

    def is_ours(self) -> bool:
        """Whether its plan.jsonl is one that Mitex wrote."""
        try:
            return bool(self.jobs())
        except (OSError, ValueError, TypeError, KeyError, RecursionError):
            return False

    def jobs(self) -> list[Job]:
        """The jobs of its plan."""
        text = (self.path / PLAN).read_text(encoding="utf-8")
        return [Job.of_record(json.loads(line)) for line in text.splitlines()]

    def of(self, job: Job) -> Path:
        """The folder of a job's state."""
        return self.path / "jobs" / job.id

    def result(self, job: Job) -> Path:
        """What a job writes."""
        return self.path / job.result

    def done(self, job: Job) -> dict[str, Any] | None:
        """What is known of a job that is done; None of another, or if its result is gone.

        Raises:
            OSError: That cannot be told now.
        """
        return _read(self.of(job) / DONE) if _is_there(self.result(job)) else None

    def failed(self, job: Job) -> dict[str, Any] | None:
        """What is known of a job that failed; None of another.

        Raises:
            OSError: That cannot be told now.
        """
        return _read(self.of(job) / FAILED)

    def write(self, job: Job, name: str, record: Mapping[str, Any]) -> None:
        """Writes one of the files of a job's state.

        Raises:
            OutputError: The disk is full, or the folder is not writable.
        """
        write_json(self.of(job) / name, record)

    def forget_failure(self, job: Job) -> None:
        """Lets a job that failed be run again."""
        (self.of(job) / FAILED).unlink(missing_ok=True)

    def start(self, job: Job, driver: str, checkpoint_time: float | None) -> dict[str, Any]:
        """Writes down that a job begins, and returns it: driver, count, time, seconds and memory.

        It is not done from now on, although it may have been before somebody removed its result.
        `count` is how often it has been started for the driver, this time included, but for attempts that
        were told to stop.
        `seconds` and `memory` are of the attempts before whose work it goes on with, up to their checkpoints;
        of one whose end nobody saw, the memory [bytes] is not known.

        Args:
            job: the job.
            driver: the command that wants it.
            checkpoint_time: when the checkpoint was written that it goes on from; None if it begins anew.

        Raises:
            OSError, OutputError: The folder cannot be written to.
        """
        previous = _read(self.of(job) / STARTS) or {}
        count = previous.get("count", 0) + 1 if previous.get("driver") == driver else 1
        record = {"driver": driver, "count": count, "time": time.time(), "seconds": 0.0, "memory": 0}
        if checkpoint_time is not None:
            last_seconds = max(checkpoint_time - previous.get("time", checkpoint_time), 0.0)
            record["seconds"] = previous.get("seconds", 0.0) + last_seconds
            record["memory"] = previous.get("memory", 0)
        # Before the result's folder is there again: who sees that finds no old record beside it.
        (self.of(job) / DONE).unlink(missing_ok=True)
        self.write(job, STARTS, record)
        return record

    def has_driver(self, name: str) -> bool:
        """Whether a command goes on, rather than wanting its jobs to stop; so it does if nobody can tell."""
        try:
            return _is_there(self.path / "drivers" / name)
        except OSError:  # a disk that is away for a moment
            return True

    def dismiss(self, name: str) -> None:
        """Lets the jobs of a command stop."""
        with suppress(OSError):
            (self.path / "drivers" / name).unlink(missing_ok=True)

    @contextmanager
    def driver(self, jobs: Sequence[Job]) -> Iterator[str]:
        """The name of a new driver, a command that runs these jobs within the context; they are the plan now.

        Raises:
            OutputError: The folder cannot be written to.
        """
        lines = [json.dumps(job.record()) + "\n" for job in jobs]
        with atomic_write(self.path / PLAN) as temporary:
            temporary.write_text("".join(lines), encoding="utf-8")
        name = f"{socket.gethostname()}-{os.getpid()}-{secrets.token_hex(4)}"
        with writing(self.path / "drivers" / name) as file:
            file.parent.mkdir(exist_ok=True)
            file.write_text(f"{time.time()}\n", encoding="utf-8")
        try:
            yield name
        finally:
            self.dismiss(name)

    def holder(self, job: Job) -> str | None:
        """Host that works on a job; None if none does.

        Raises:
            OSError: That cannot be told now.
        """
        return claims.holder(self.of(job))


def _is_there(path: Path) -> bool:
    """Whether a path exists; unlike `Path.exists`, it takes no error of a disk for an answer."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def _read(path: Path) -> dict[str, Any] | None:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None
