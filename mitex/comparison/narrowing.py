"""A part of a comparison: some of its exemplars, meshes and methods, perhaps with other settings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mitex.batch import Plan
from mitex.comparison.plan import add_setting, label_of
from mitex.errors import ConfigError
from mitex.suggestions import suggestion


def narrowed(
    plan: Plan,
    *,
    exemplars: Sequence[str] = (),
    meshes: Sequence[str] = (),
    labels: Sequence[str] = (),
    settings: Sequence[str] = (),
) -> Plan:
    """Those jobs of a plan that are asked for. They keep their ids unless their settings change.

    Args:
        plan: of all.
        exemplars, meshes: which of its own, as the plan has them or by name without folder and suffix; all if
            none are given.
        labels: of its methods; dashes may stand for underscores; all if none are given.
        settings: `LABEL:KEY=VALUE`, as of `comparison_plan`.

    Raises:
        ConfigError: The plan has none of that name, or several, or a setting does not fit.
    """
    tables: dict[str, dict[str, Any]] = plan.content()["methods"]
    if labels:
        names = [label_of(label, tables) for label in labels]
        tables = {label: tables[label] for label in _selection(list(tables), names, "method")}
    for setting in settings:
        add_setting(tables, setting)
    for key, names in (("exemplars", exemplars), ("meshes", meshes)):
        if names:
            kind = "exemplar" if key == "exemplars" else "mesh"
            own = list(dict.fromkeys(text for table in tables.values() for text in table.get(key, ())))
            selection = _selection(own, names, kind)
            for table in tables.values():
                table[key] = [text for text in table.get(key, ()) if text in selection]
    return Plan.of({"methods": tables}, plan.folder)


def _selection(own: Sequence[str], names: Sequence[str], kind: str) -> list[str]:
    """The texts that are named, in their own order."""
    selection = {_named(name, own, kind) for name in names}
    return [text for text in own if text in selection]


def _named(name: str, own: Sequence[str], kind: str) -> str:
    """The text that is named, as it stands or without folder and suffix."""
    named = [name] if name in own else [text for text in own if Path(text).stem == name]
    if not named:
        known = sorted({*own, *(Path(text).stem for text in own)})
        raise ConfigError(f"the comparison has no {kind} '{name}'", suggestion(name, known))
    if len(named) > 1:
        raise ConfigError(f"the comparison has more than one {kind} '{name}'", f"name {' or '.join(named)}")
    return named[0]
