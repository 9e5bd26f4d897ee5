"""The results of a comparison's jobs: which fit and which asset belong together, and their measurements."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mitex.batch import Job, Report, Row

LIT, VIEW = "lit", "view"  # pictures: on the mesh in light; where it was captured, of a view held out


@dataclass(frozen=True)
class Result:
    """A texture on a mesh, or one that can be put on none, by one method and seed.

    Attributes:
        id: of the job that wrote it.
        exemplar, mesh: paths or names; None for no mesh.
        method: its label in the plan.
        seed: of the fit.
        asset: the file; None without a mesh.
        run: the run folder of the fit.
        numbers: key of a `Measure` -> value; without those that could not be measured.
        pictures: `LIT` and `VIEW`, as far as there are such -> file.
        time: when the job that wrote it began, as its record says.
    """

    id: str
    exemplar: str
    mesh: str | None
    method: str
    seed: int | None
    asset: Path | None
    run: Path
    numbers: Mapping[str, float] = field(default_factory=dict)
    pictures: Mapping[str, Path] = field(default_factory=dict)
    time: str | None = None

    @property
    def pair(self) -> tuple[str, str | None]:
        """Exemplar and mesh."""
        return self.exemplar, self.mesh


def results_of(report: Report, source: str) -> list[Result]:
    """The results of a batch's jobs that are done, with the time and memory that they took.

    Args:
        report: of the batch.
        source: option of the fits that names what they learn from.
    """
    rows = {row.job.id: row for row in report.rows}
    needed = {row.job.needs for row in report.rows}
    return [
        _result(report.folder, _chain(row, rows), source)
        for row in report.rows
        if row.state == "done" and row.job.id not in needed
    ]


def _chain(row: Row, rows: Mapping[str, Row]) -> list[Row]:
    """A job and those that it follows from, the first one last."""
    chain = [row]
    while (needs := chain[-1].job.needs) is not None:
        chain.append(rows[needs])
    return chain


def _result(folder: Path, chain: Sequence[Row], source: str) -> Result:
    """Of a job and those that it follows from."""
    job, is_apply = chain[0].job, chain[0].job.words[0] == "apply"
    fits = chain[1:] if is_apply else chain
    return Result(
        id=job.id,
        exemplar=_argument(fits[-1].job, source),
        mesh=_argument(job, "mesh") if is_apply else None,
        method=str(job.about["method"]),
        seed=job.about["seed"],
        asset=folder / _argument(job, "out") if is_apply else None,
        run=folder / fits[0].job.result,
        time=chain[0].record.get("time"),
        numbers={
            "fit_seconds": float(sum(fit.record["seconds"] for fit in fits)),
            "memory": float(max(row.record["memory"] for row in chain)),
        }
        | ({"apply_seconds": float(chain[0].record["seconds"])} if is_apply else {}),
    )


def _argument(job: Job, option: str) -> str:
    """The value of an option in the words of a job."""
    words: Sequence[str] = job.words
    joined = f"--{option}="
    for word in words:
        if word.startswith(joined):
            return word.removeprefix(joined)
    return words[words.index(f"--{option}") + 1]


def labels(texts: Iterable[str]) -> dict[str, str]:
    """What people call absolute paths and names: path or name -> label.

    A path is called by its stem; where others are called the same, by its folder and name, or as a whole.
    Names and words are called as they are.
    """
    own = {text: Path(text).stem if os.path.isabs(text) else text for text in texts}
    for longer in (lambda text: os.path.join(*Path(text).parts[-2:]), str):
        counts = Counter(own.values())
        own = {
            text: longer(text) if os.path.isabs(text) and counts[label] > 1 else label
            for text, label in own.items()
        }
    return own
