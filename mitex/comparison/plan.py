"""The plan of a comparison: from lists of exemplars, meshes and methods to the jobs of a batch."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from mitex.batch import MethodPlan, Plan
from mitex.batch.options import apply_kinds, fit_kinds
from mitex.batch.plan import OWN_KEYS
from mitex.comparison.kinds import KINDS, Kind
from mitex.errors import ConfigError
from mitex.methods.checks import in_range
from mitex.methods.layout import EXEMPLAR_WIDTH
from mitex.methods.registry import methods
from mitex.suggestions import suggestion
from mitex.training import values

WIDTH = "exemplar_width"  # option of `mitex apply` of methods whose pattern has another size without it
SCALES = (WIDTH, "scale")
MOST_SEEDS = 1000


def comparison_plan(
    exemplars: Sequence[str],
    meshes: Sequence[str],
    names: Sequence[str],
    *,
    seeds: int = 1,
    settings: Sequence[str] = (),
    folder: str | Path = ".",
) -> Plan:
    """Every method on every exemplar and mesh, each fit once for each seed.

    Args:
        exemplars, meshes: paths, patterns or names, as in a plan of `mitex batch`.
        names: of the methods; dashes stand for underscores.
        seeds: how many: 0, 1, ...
        settings: `METHOD:KEY=VALUE`, an option or setting of `mitex fit METHOD`, or `METHOD:apply.KEY=VALUE`,
            an option of `mitex apply`.
        folder: where relative paths begin.

    Raises:
        ConfigError: An unknown method or key, a value that does not fit, or nothing to do.
    """
    tables: dict[str, dict[str, Any]] = {}
    for name in (name.strip().replace("-", "_") for name in names):
        if name not in methods():
            raise ConfigError(f"there is no method '{name}'", suggestion(name, methods()))
        if name in tables:
            raise ConfigError(f"method '{name}' is named twice", "name it once")
        tables[name] = {}
    for setting in settings:
        add_setting(tables, setting)
    content = {
        "exemplars": list(exemplars),
        "meshes": list(meshes),
        "seeds": list(_first_seeds(seeds)),
        "methods": tables,
    }
    return prepared(Plan.of(content, folder))


def prepared(plan: Plan, seeds: int | None = None) -> Plan:
    """A plan of `mitex batch`, checked and completed so that what its methods make can be compared.

    Args:
        plan: the plan.
        seeds: how many, in place of those of the plan.

    Raises:
        ConfigError: Methods learn from different things, or from what is not compared; one is put on no mesh,
            and nothing is measured then; the output is no .glb.
    """
    kind = KINDS[source_of(plan)]
    parts = tuple(_prepared(part, kind) for part in plan.methods)
    if seeds is not None:
        parts = tuple(replace(part, seeds=_first_seeds(seeds)) for part in parts)
    return replace(plan, methods=parts)


def source_of(plan: Plan) -> str:
    """What all methods of a plan learn from: a key of `KINDS`.

    Raises:
        ConfigError: They learn from different things, or from what is not compared.
    """
    first, *others = map(plan.first, plan.methods)
    for part in others:
        if part.learns_from != first.learns_from:
            problem = (
                f"{first.label} learns from {first.learns_from}, and {part.label} from {part.learns_from}"
            )
            raise ConfigError(problem, "compare methods that learn from the same")
    if first.learns_from not in KINDS:
        problem = f"methods that learn from a {first.learns_from} are not compared"
        raise ConfigError(problem, f"name some that learn from: {', '.join(KINDS)}")
    return first.learns_from


def _first_seeds(count: int) -> tuple[int, ...]:
    in_range("`seeds`", count, 1, MOST_SEEDS)
    return tuple(range(count))


def _prepared(part: MethodPlan, kind: Kind) -> MethodPlan:
    """As `prepared`, of one method: only fit if it is put on no mesh, with patterns of one size otherwise."""
    method = methods()[part.method]
    output = "glb" if method.applies_to_meshes else "none"
    if part.output not in ("glb", output):
        problem = f"methods.{part.label} writes {part.output}"
        raise ConfigError(problem, f'leave out `output`, or say "{output}"')
    if not method.applies_to_meshes:
        if not kind.meshless:
            raise ConfigError(f"textures of {method.name} are put on no mesh", "compare others")
        return replace(part, output=output)
    if not part.meshes:
        raise ConfigError("there are no meshes to compare on", "name some")
    needs_width = (
        part.learns_from == "exemplar"
        and WIDTH in apply_kinds(method)
        and not any(name in part.apply for name in SCALES)
    )
    return replace(part, apply={**part.apply, WIDTH: EXEMPLAR_WIDTH}) if needs_width else part


def add_setting(tables: Mapping[str, dict[str, Any]], setting: str) -> None:
    """Puts `LABEL:KEY=VALUE` into the table of a plan's method, or `LABEL:apply.KEY=VALUE` into its `apply`.

    Raises:
        ConfigError: It is no setting, of no method of the plan, or the value does not fit.
    """
    name, colon, rest = setting.partition(":")
    key, equals, text = rest.partition("=")
    if not (colon and equals and key.strip()):
        raise ConfigError(f"'{setting}' is not a setting", "write METHOD:KEY=VALUE, such as nca:steps=300")
    label = label_of(name, tables)
    if label not in tables:
        raise ConfigError(f"'{setting}' is of no method that is compared", suggestion(label, tables))
    key, table = key.strip().replace("-", "_"), tables[label]
    if key in (*OWN_KEYS, "apply"):
        problem = f"'{setting}' is no setting of a method: '{key}' belongs to plans"
        raise ConfigError(problem, "write it into a plan")
    method = methods()[table.get("method", label)]
    if key.startswith("apply."):
        key, table = key.removeprefix("apply."), table.setdefault("apply", {})
        table[key] = _value(key, text.strip(), apply_kinds(method), label)
    else:
        table[key] = _value(key, text.strip(), fit_kinds(method), label)


def label_of(name: str, labels: Container[str]) -> str:
    """The label that is meant: the name as it stands if it is one, otherwise with underscores for dashes."""
    name = name.strip()
    return name if name in labels else name.replace("-", "_")


def _value(key: str, text: str, kinds: Mapping[str, Any], label: str) -> Any:
    """The value of an option; that of a setting stays a text, which its config reads."""
    return text if key not in kinds else values.read(values.parse, text, kinds[key], f"{key} of {label}")
