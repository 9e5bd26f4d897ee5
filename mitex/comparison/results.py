"""The results of a comparison's jobs: which fit and which asset belong together, and what was measured."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mitex.batch import Job, Report, Row


@dataclass(frozen=True)
class Result:
    """A texture on a mesh, by one method and seed.

    Attributes:
        id: of the job that wrote it.
        exemplar, mesh: paths or names.
        method: its label in the plan.
        seed: of the fit.
        asset: the file.
        run: the run folder of the fit.
        numbers: key of a `Measure` -> value; without those that could not be measured.
        pictures: kind -> file.
    """

    id: str
    exemplar: str
    mesh: str
    method: str
    seed: int | None
    asset: Path
    run: Path
    numbers: Mapping[str, float] = field(default_factory=dict)
    pictures: Mapping[str, Path] = field(default_factory=dict)

    @property
    def pair(self) -> tuple[str, str]:
        """Exemplar and mesh."""
        return self.exemplar, self.mesh


def results_of(report: Report, source: str) -> list[Result]:
    """What the jobs of a batch that are done have written, with the time and memory that they took.

    Args:
        report: of the batch.
        source: option of the fits that names what they learn from.
    """
    rows = {row.job.id: row for row in report.rows}
    return [
        _result(report.folder, row, _needed(row, rows), source)
        for row in report.rows
        if row.state == "done" and row.job.words[0] == "apply"
    ]


def _needed(row: Row, rows: Mapping[str, Row]) -> list[Row]:
    """The fits that a result follows from, the last one first."""
    fits: list[Row] = []
    while row.job.needs is not None:
        row = rows[row.job.needs]
        fits.append(row)
    return fits


def _result(folder: Path, row: Row, fits: Sequence[Row], source: str) -> Result:
    job = row.job
    return Result(
        id=job.id,
        exemplar=_argument(fits[-1].job, source),
        mesh=_argument(job, "mesh"),
        method=str(job.about["method"]),
        seed=job.about["seed"],
        asset=folder / _argument(job, "out"),
        run=folder / fits[0].job.result,
        numbers=_costs(row.record, [fit.record for fit in fits]),
    )


def _costs(applied: Mapping[str, Any], fitted: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    return {
        "fit_seconds": float(sum(fit["seconds"] for fit in fitted)),
        "apply_seconds": float(applied["seconds"]),
        "memory": float(max(record["memory"] for record in (applied, *fitted))),
    }


def _argument(job: Job, option: str) -> str:
    """The value of an option in the words of a job."""
    words: Sequence[str] = job.words
    return words[words.index(f"--{option}") + 1]


def label(text: str) -> str:
    """What people call a path or a name; words are called as they are."""
    return Path(text).stem if os.sep in text else text
