"""The report as one HTML file that works offline: pictures inside, tables that can be sorted."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape

import numpy as np

from mitex import __version__
from mitex.comparison.html import DASH, QUALITY, count_text, items, picture, template, text_of
from mitex.comparison.measures import Measure
from mitex.comparison.provenance import Provenance
from mitex.comparison.results import LIT, VIEW, Result, labels
from mitex.comparison.summary import Summary
from mitex.comparison.tables import meaning_html, table_html
from mitex.page import jpeg

FIRST_CONDITION = (
    "Exemplars and meshes: the same for every method, but where a cell is empty. Seeds: as many as each row "
    "says."
)
LAST_CONDITIONS = (
    "Pictures: the same camera and light. What a method has learned besides what is measured shows in them.",
    "Not the same: steps and settings, which are each method's own defaults unless the table below says "
    "something else, and the load of the machine while seconds were measured.",
)


@dataclass(frozen=True)
class Page:
    """What a report shows.

    Attributes:
        results: all results.
        tables: means of them.
        exemplars: path, name or words -> picture (S, S, 3), sRGB in [0, 1]; None without one.
        floors: exemplar and mesh -> measure -> value of the exemplar beside itself.
        failures: a line for each job or measurement that failed.
        measures: what the numbers are.
        conditions: what was the same for all, besides inputs and pictures.
        provenance: how the results were made.
    """

    results: Sequence[Result]
    tables: Sequence[Summary]
    exemplars: Mapping[str, np.ndarray | None]
    floors: Mapping[tuple[str, str | None], Mapping[str, float]]
    failures: Sequence[str]
    measures: Sequence[Measure]
    conditions: Sequence[str]
    provenance: Provenance

    def html(self) -> str:
        """The text of the file."""
        return template("report.html").substitute(
            style=text_of("style.css"),
            title=escape(self._title()),
            subtitle=escape(self._subtitle()),
            failures=self._failures(),
            seeds=self._seed_buttons(),
            looks="".join(map(self._pictures, self.exemplars)),
            numbers_note=escape(self._note()),
            tables=self._tables(),
            meanings="".join(map(meaning_html, self.measures)),
            conditions=items((FIRST_CONDITION, *self.conditions, *LAST_CONDITIONS)),
            provenance=self.provenance.html(),
            footer=f"Mitex {escape(__version__)}, {time.strftime('%-d %B %Y')}",
        )

    @cached_property
    def labels(self) -> dict[str, str]:
        """What exemplars and meshes are called."""
        return labels(self.exemplars) | labels(r.mesh for r in self.results if r.mesh is not None)

    @property
    def methods(self) -> list[str]:
        """Labels, in the plan's order."""
        return list(dict.fromkeys(result.method for result in self.results))

    @property
    def seeds(self) -> list[int]:
        """Of all results, but for those of presets, in order."""
        return sorted({result.seed for result in self.results if result.seed is not None})

    @property
    def seed_counts(self) -> list[int]:
        """How many seeds methods have, the fewest and the most; none without results."""
        seeds = [{r.seed for r in self.results if r.method == name} for name in self.methods]
        counts = [len(of_method) for of_method in seeds]
        return [min(counts), max(counts)] if counts else []

    def _title(self) -> str:
        *names, last = self.methods or ["nothing"]
        return f"Comparing {', '.join(names)} and {last}" if names else f"Measuring {last}"

    def _subtitle(self) -> str:
        exemplars = ", ".join(self.labels[text] for text in self.exemplars)
        meshes = ", ".join(dict.fromkeys(self.labels[r.mesh] for r in self.results if r.mesh is not None))
        inputs = " on ".join(filter(None, (exemplars, meshes)))
        fewest, most = self.seed_counts or (0, 0)
        seeds = count_text(most, "seed")
        return "; ".join(filter(None, (inputs, seeds if fewest == most else f"{fewest} to {seeds}")))

    def _failures(self) -> str:
        return (
            f'<div class="failed"><p>Not done:</p><ul>{items(self.failures)}</ul></div>'
            if self.failures
            else ""
        )

    def _seed_buttons(self) -> str:
        if len(self.seeds) < 2:
            return ""
        buttons = "".join(
            f'<button value="{seed}" aria-pressed="{str(k == 0).lower()}">{seed}</button>'
            for k, seed in enumerate(self.seeds)
        )
        return f'<p class="seeds"><span class="soft">Seed</span> {buttons}</p>'

    def _pictures(self, exemplar: str) -> str:
        """The pictures for an exemplar: a row for a view and for each mesh, a column for each method."""
        results = [result for result in self.results if result.exemplar == exemplar]
        meshes = dict.fromkeys(result.mesh for result in results if result.mesh is not None)
        rows = [self._row(self.labels[m], LIT, [r for r in results if r.mesh in (m, None)]) for m in meshes]
        if any(VIEW in result.pictures for result in results):
            rows.insert(0, self._row("view held out", VIEW, results))
        images = [self._exemplar(exemplar), *[""] * len(rows)]
        body = "".join(f"<tr><td>{image}</td>{row}</tr>" for image, row in zip(images, rows, strict=False))
        heads = "".join(f"<th>{escape(name)}</th>" for name in self.methods)
        head = f"<tr><th>{escape(self.labels[exemplar])}</th><th></th>{heads}</tr>"
        content = f"<thead>{head}</thead><tbody>{body}</tbody>"
        columns = f"--columns: {len(self.methods) + 1}"
        return f'<div class="wide"><table class="looks" style="{columns}">{content}</table></div>'

    def _row(self, title: str, kind: str, results: Sequence[Result]) -> str:
        cells = (self._cell(kind, [r for r in results if r.method == name]) for name in self.methods)
        return f"<th>{escape(title)}</th>{''.join(cells)}"

    def _exemplar(self, exemplar: str) -> str:
        image = self.exemplars[exemplar]
        return "" if image is None else picture(jpeg(image, QUALITY), f"exemplar {self.labels[exemplar]}")

    def _cell(self, kind: str, results: Sequence[Result]) -> str:
        """A cell with a method's picture of each seed, of which one is shown: the page's, or the first."""
        by_seed: dict[int | None, Result] = {}
        for result in results:
            if kind in result.pictures:
                by_seed.setdefault(result.seed, result)
        if not by_seed:
            return f'<td class="none">{DASH if results else "not done"}</td>'
        page_seed = self.seeds[0] if self.seeds else None
        visible_seed = page_seed if page_seed in by_seed else next(iter(by_seed))
        images = [
            picture(
                result.pictures[kind].read_bytes(),
                self._description(result, kind),
                f' data-seed="{_seed_text(seed)}"' + (" hidden" if seed != visible_seed else ""),
            )
            for seed, result in by_seed.items()
        ]
        note = "" if visible_seed == page_seed else f"seed {_seed_text(visible_seed)}"
        return f'<td data-note="{note}">{"".join(images)}</td>'

    def _note(self) -> str:
        fewest, most = self.seed_counts or (0, 0)
        if most < 2:
            return (
                "Of one seed: how much is due to chance is not known, so nothing is marked as the best. More "
                "seeds (--seeds 3) tell. Click on a heading to sort."
            )
        seeds = f"{most} seeds" if fewest == most else "as many seeds as each row says"
        single = (
            "" if fewest > 1 else "Beside a method of one seed, whose chance is not known, nothing is green. "
        )
        return (
            f"Means over {seeds} ± their standard deviation. Green is what is better than every other "
            f"method by more than both spreads together. {single}Click on a heading to sort."
        )

    def _tables(self) -> str:
        """That of the means over all pairs first."""
        ordered = sorted(self.tables, key=lambda table: table.pair is not None)
        floors = [self.floors.get(table.pair, {}) if table.pair else {} for table in ordered]
        titles = ["Means over all of them" if t.pair is None else self._title_of(*t.pair) for t in ordered]
        return "".join(map(table_html, ordered, floors, titles))

    def _title_of(self, exemplar: str, mesh: str | None) -> str:
        return self.labels[exemplar] if mesh is None else f"{self.labels[exemplar]} on {self.labels[mesh]}"

    def _description(self, result: Result, kind: str) -> str:
        """What a picture shows."""
        view = f"{self.labels[result.exemplar]}, view held out,"
        what = view if kind == VIEW else self._title_of(*result.pair)
        return f"{what} by {result.method}, seed {_seed_text(result.seed)}"


def _seed_text(seed: int | None) -> str:
    return "of the preset" if seed is None else str(seed)
