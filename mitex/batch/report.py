"""How far the jobs of a batch folder are: as text, and as a table of what they measured."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mitex.batch.folder import STARTS, BatchFolder
from mitex.batch.jobs import Job
from mitex.errors import OutputError
from mitex.records import write_csv
from mitex.training.progress import clock

STATES = ("done", "running", "interrupted", "waiting", "failed", "blocked")
TABLE = "results.csv"
COLUMNS = ("id", "state", "method", "exemplar", "seed", "mesh", "seconds", "memory", "host", "result")


@dataclass(frozen=True)
class Row:
    """A job and how far it is.

    Attributes:
        job: the job.
        state: one of `STATES`; "blocked" if a job that it needs failed.
        record: of a job that is done: time, seconds, memory [bytes], host and metrics; of one that failed:
            its error and exit code; of one that is running: its host.
    """

    job: Job
    state: str
    record: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Report:
    """All jobs of a batch folder, in the plan's order."""

    folder: Path
    rows: tuple[Row, ...]

    def count(self, state: str) -> int:
        """How many jobs are in a state."""
        return sum(row.state == state for row in self.rows)

    @property
    def failures(self) -> list[Row]:
        """The jobs that failed."""
        return [row for row in self.rows if row.state == "failed"]

    def text(self) -> str:
        """A line in all, and one for each job that runs or failed."""
        counts = Counter(row.state for row in self.rows)
        states = ", ".join(f"{counts[state]} {state}" for state in STATES if counts[state])
        lines = [f"{len(self.rows)} jobs: {states}"]
        for row in self.rows:
            if row.state == "running":
                lines.append(f"running  {row.job.name} on {row.record['host']}")
            elif row.state == "failed":
                lines.append(f"failed   {row.job.name}: {row.record.get('error')}")
        seconds = sum(row.record["seconds"] for row in self.rows if row.state == "done")
        return "\n".join([*lines, f"the jobs that are done took {clock(seconds)}"] if seconds else lines)

    def write_csv(self) -> Path:
        """Writes results.csv: a line a job, with what the fits measured at their last step.

        Raises:
            OutputError: The disk is full, or the folder is not writable.
        """
        records = [_record(row) for row in self.rows]
        metrics = sorted({key for record in records for key in record} - set(COLUMNS))
        write_csv(self.folder / TABLE, [*COLUMNS, *metrics], records)
        return self.folder / TABLE


def status(path: str | Path) -> Report:
    """How far the jobs of a folder are; changes nothing.

    Raises:
        ConfigError: `mitex batch` has not written the folder.
        OutputError: It cannot be read now.
    """
    folder = BatchFolder.existing(path)
    return report_of(folder, folder.jobs())


def report_of(folder: BatchFolder, jobs: Iterable[Job]) -> Report:
    """How far some jobs of a folder are, each after those that it needs.

    Raises:
        OutputError: The folder cannot be read now.
    """
    rows: dict[str, Row] = {}
    try:
        for job in jobs:
            rows[job.id] = _row(job, folder, rows)
    except OSError as e:
        raise OutputError(f"cannot read '{folder.path}' ({e.strerror or e})", "try again later") from e
    return Report(folder.path, tuple(rows.values()))


def _row(job: Job, folder: BatchFolder, before: Mapping[str, Row]) -> Row:
    """A job by the files of its state; `before` has the rows of those that it may need."""
    if record := folder.done(job):
        return Row(job, "done", record)
    if host := folder.holder(job):
        return Row(job, "running", {"host": host})
    if record := folder.failed(job):
        return Row(job, "failed", record)
    if job.needs is not None and job.needs in before and before[job.needs].state in ("failed", "blocked"):
        return Row(job, "blocked")
    return Row(job, "interrupted" if (folder.of(job) / STARTS).exists() else "waiting")


def _record(row: Row) -> dict[str, Any]:
    """Its line in the table."""
    own = {"id": row.job.id, "state": row.state, "result": row.job.result, **row.job.about}
    process = {key: row.record[key] for key in ("seconds", "memory", "host") if key in row.record}
    metrics = row.record.get("metrics", {})
    return {**{f"last_{key}": value for key, value in metrics.items()}, **own, **process}
