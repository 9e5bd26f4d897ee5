"""How results came about, so that they can be repeated: the plan, and the settings of each method."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import tomli_w

from mitex import __version__
from mitex.batch import MethodPlan, Plan
from mitex.comparison.html import DASH
from mitex.comparison.results import Result
from mitex.training.run import CONFIG


@dataclass(frozen=True)
class Provenance:
    """What a comparison follows from.

    Attributes:
        plan: what was asked for.
        runs: method -> text of the config.toml of its first run, with all settings and versions.
    """

    plan: Plan
    runs: Mapping[str, str]

    @staticmethod
    def of(plan: Plan, results: Sequence[Result]) -> Provenance:
        """Of results that a plan has come to."""
        files = {result.method: result.run / CONFIG for result in reversed(results)}
        texts = {part.label: files[part.label] for part in plan.methods if part.label in files}
        return Provenance(plan, {m: file.read_text("utf-8") for m, file in texts.items() if file.is_file()})

    def record(self) -> dict[str, Any]:
        """As part of a JSON object: version, date, plan, the folder of its relative paths, and settings."""
        return {
            "mitex": __version__,
            "date": time.strftime("%Y-%m-%d"),
            "plan": self.plan.content(),
            "folder": str(self.plan.folder),
            "settings": {method: tomllib.loads(text) for method, text in self.runs.items()},
        }

    def html(self) -> str:
        """A table of what was asked for, then the plan as a file, and all settings of each method."""
        rows = "".join(map(_row, self.plan.methods))
        head = "<tr><th>method</th><th>options and settings of its fit</th><th>of mitex apply</th></tr>"
        plan = f"# Paths are relative to {self.plan.folder}\n{tomli_w.dumps(self.plan.content())}"
        texts = {"The plan, for mitex compare --plan": plan} | {
            f"All settings of {method}": text for method, text in self.runs.items()
        }
        table = f'<div class="wide"><table class="settings">{head}{rows}</table></div>'
        return table + "".join(_details(title, text) for title, text in texts.items())


def _row(part: MethodPlan) -> str:
    apply = DASH if part.output == "none" else _options(part.apply)
    return f"<tr><td>{escape(part.label)}</td><td>{_options(part.fit)}</td><td>{apply}</td></tr>"


def _options(table: Mapping[str, Any]) -> str:
    return escape(", ".join(f"{key} = {value}" for key, value in table.items())) or "defaults"


def _details(title: str, text: str) -> str:
    return f"<details><summary>{escape(title)}</summary><pre>{escape(text)}</pre></details>"
