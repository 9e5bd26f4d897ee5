"""Running a comparison: the jobs of its plan, the measurement of their results, and the report."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from mitex.batch import Engine, Event, Plan, Report, run_plan
from mitex.batch.folder import BatchFolder
from mitex.comparison.kinds import KINDS, Kind
from mitex.comparison.measuring import Measurements, measure
from mitex.comparison.page import Page
from mitex.comparison.plan import source_of
from mitex.comparison.provenance import Provenance
from mitex.comparison.results import Result, results_of
from mitex.comparison.store import Store
from mitex.comparison.study import check_study, write_study
from mitex.comparison.summary import Summary, summaries
from mitex.errors import ConfigError
from mitex.paths import atomic_write, check_own_folder
from mitex.records import write_csv, write_json

BATCH, MEASURED = "batch", "measured"  # folders: of the jobs, and of the measurements of their results
NAMES, PLACES = ("exemplar", "mesh", "method", "seed"), ("asset", "run")  # of a result, besides its numbers
REPORT, TABLE, RECORD = "report.html", "report.csv", "report.json"


@dataclass(frozen=True)
class Comparison:
    """The outcome of a comparison.

    Attributes:
        folder: of everything.
        results: with what was measured of them.
        tables: their means.
        failures: a line for each job or measurement that failed.
        missing: jobs that are not done, and results that cannot be measured.
        total: jobs in all.
    """

    folder: Path
    results: tuple[Result, ...]
    tables: tuple[Summary, ...]
    failures: tuple[str, ...] = field(default=())
    missing: int = 0
    total: int = 0

    @property
    def report(self) -> Path:
        """The HTML file."""
        return self.folder / REPORT


def compare(
    plan: Plan,
    folder: str | Path,
    engine: Engine | None = None,
    *,
    threads: int | None = None,
    retry: bool = False,
    study: bool = False,
    judge: str | None = None,
    on_event: Callable[[Event], None] | None = None,
) -> Comparison:
    """Does what is not done of a plan, measures what is not measured, and writes report.html, .csv and .json.

    A job that fails does not stop the others; the report has a line for it.

    Args:
        plan: as `comparison_plan` or `prepared` make it.
        folder: new, empty, or that of an earlier call, which goes on.
        engine, threads, retry, on_event: as of `run_plan`.
        study: whether to write study.html and study.json, too.
        judge: CLIP folder that scores textures from words, as of `text_image_model`.

    Returns:
        What was measured.

    Raises:
        WeightsError: There is no such judge.
        ConfigError: An input does not exist, a job is there twice, there are no words to judge, or no two
            methods for a study; if others have failed, the report is there nevertheless.
        OutputError: The folder holds other files, or cannot be written to.
        KeyboardInterrupt: As of `run_plan`; what was measured is kept.
    """
    kind = KINDS[source_of(plan)]
    _check_judge(kind, judge)
    if study:
        check_study(plan)
    place = check_own_folder(folder, lambda path: BatchFolder(path / BATCH).is_ours())
    report = run_plan(plan, place / BATCH, engine, threads=threads, retry=retry, on_event=on_event)
    results = results_of(report, source_of(plan))
    measurements = measure(results, partial(kind.pair_of, judge=judge), Store(place / MEASURED))
    comparison = _comparison(place, results, measurements, report, kind)
    _write(comparison, measurements, kind, Provenance.of(plan, comparison.results))
    if study:
        write_study(place, comparison.results, measurements.exemplars)
    return comparison


def _check_judge(kind: Kind, judge: str | None) -> None:
    """Refuses, before any work, a judge that is not there, or where there is nothing to judge."""
    if kind.judged:
        from mitex.features.text_model import model_folder

        model_folder(judge)
    elif judge is not None:
        raise ConfigError("there are no words to judge", "leave out `judge`")


def _comparison(
    folder: Path, everything: Sequence[Result], measurements: Measurements, report: Report, kind: Kind
) -> Comparison:
    """What jobs and measurements have come to.

    Args:
        folder: of the comparison.
        everything: the results of the jobs, also those that cannot be measured.
        measurements, report: of these results, and of the jobs.
        kind: of the comparison.
    """
    measured = measurements.results
    results = tuple(measured[result.id] for result in everything if result.id in measured)
    failures = (
        *(f"{row.job.name}: {row.record.get('error')}" for row in report.failures),
        *measurements.failures,
    )
    total = len(report.rows)
    missing = total - report.count("done") + len(everything) - len(results)
    return Comparison(folder, results, tuple(summaries(results, kind.measures)), failures, missing, total)


def _write(comparison: Comparison, measurements: Measurements, kind: Kind, provenance: Provenance) -> None:
    """Writes the report as a page, a table and a JSON object."""
    judge, floors = measurements.judge, measurements.floors
    page = Page(
        results=comparison.results,
        tables=comparison.tables,
        exemplars=measurements.exemplars,
        floors=floors,
        failures=comparison.failures,
        measures=kind.measures,
        conditions=kind.conditions if judge is None else (*kind.conditions, f"The judge: {judge}."),
        provenance=provenance,
    )
    with atomic_write(comparison.report) as temporary:
        temporary.write_text(page.html(), encoding="utf-8", errors="replace")
    columns = (*NAMES, *(measure.key for measure in kind.measures), *PLACES)
    rows = [_row(result, comparison.folder) for result in comparison.results]
    write_csv(comparison.folder / TABLE, columns, rows)
    record: dict[str, Any] = {
        **provenance.record(),
        "judge": judge,
        "results": rows,
        "means": [_record(table, floors) for table in comparison.tables],
        "failures": list(comparison.failures),
        "measures": {m.key: {"better": m.better, "meaning": m.meaning} for m in kind.measures},
    }
    write_json(comparison.folder / RECORD, record)


def _row(result: Result, folder: Path) -> dict[str, Any]:
    """A result in the table and the JSON object; its places are relative to the folder."""
    names = {key: getattr(result, key) for key in NAMES}
    places = {key: getattr(result, key) for key in PLACES}
    relative = {key: place and os.path.relpath(place, folder) for key, place in places.items()}
    return {**names, **result.numbers, **relative}


def _record(table: Summary, floors: Mapping[tuple[str, str | None], Mapping[str, float]]) -> dict[str, Any]:
    """A table of means in the JSON object, where null stands for what is not known."""
    cells = [
        {"method": method, "measure": key} | {k: v if v == v else None for k, v in asdict(cell).items()}
        for (method, key), cell in table.cells.items()
    ]
    exemplar, mesh = table.pair or (None, None)
    own = {} if table.pair is None else floors[table.pair]
    return {"exemplar": exemplar, "mesh": mesh, "cells": cells, "exemplar_beside_itself": own}
