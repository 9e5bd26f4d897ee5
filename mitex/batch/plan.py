"""A plan: which exemplars, meshes and methods, with which settings. Read from TOML and checked."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from mitex.batch.options import check_options, check_source
from mitex.errors import ConfigError
from mitex.methods.registry import methods
from mitex.paths import expanded
from mitex.ranges import SEEDS
from mitex.suggestions import suggestion
from mitex.training import values

MOST_BYTES = 1 << 20  # of a plan
Output = Literal["glb", "obj", "ply", "exr", "png", "jpg", "maps", "none"]
LISTS = {"exemplars": tuple[str, ...], "meshes": tuple[str, ...], "seeds": tuple[int, ...]}
KEYS = {**LISTS, "output": Output}
OWN_KEYS = {
    **LISTS,
    "output": Output,
    "method": str,
    "source": str,
    "of": str,
}  # of a method's table, besides its options
TABLES = {"methods": "tables such as [methods.NAME]", "apply": "a table such as [methods.NAME.apply]"}


@dataclass(frozen=True)
class MethodPlan:
    """A method with its options, and what it is run on.

    Attributes:
        label: its name in the plan, of which there can be several for one method.
        method: its name.
        exemplars, meshes: paths, patterns or names; relative ones belong to the plan's folder.
        seeds: of the fits, and of `apply` where it takes one; none for those of preset and `apply`.
        output: what `apply` writes: a file of this format, or a folder of maps; "none": there are fits alone.
        fit: options and settings of `mitex fit`, by name.
        apply: options of `mitex apply`, by name.
        source: option of `mitex fit` that the exemplars are given to, if not the method's usual one: "text".
        of: label of a method before it, whose run for the same exemplar and seed it learns from, in place of
            the exemplar.
    """

    label: str
    method: str
    exemplars: tuple[str, ...]
    meshes: tuple[str, ...] = ()
    seeds: tuple[int, ...] = ()
    output: str = "glb"
    fit: Mapping[str, Any] = field(default_factory=dict)
    apply: Mapping[str, Any] = field(default_factory=dict)
    source: str | None = None
    of: str | None = None

    def __post_init__(self) -> None:
        if self.output == "none" and self.apply:
            problem = f"methods.{self.label} is only fit, and has options of `mitex apply`"
            raise ConfigError(problem, "leave these out")

    @property
    def learns_from(self) -> str:
        """The option of `mitex fit` that the exemplars, or the runs of another method, are given to."""
        return self.source or methods()[self.method].learns_from

    def table(self) -> dict[str, Any]:
        """Its table in the TOML file of a plan that has no other keys."""
        own = {key: value for key in OWN_KEYS if (value := getattr(self, key))}
        values = {**own, **self.fit, **({"apply": dict(self.apply)} if self.apply else {})}
        return {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}


@dataclass(frozen=True)
class Plan:
    """What is to be made.

    Attributes:
        methods: each on all its exemplars, seeds and meshes.
        folder: where relative paths begin.
    """

    methods: tuple[MethodPlan, ...]
    folder: Path

    def first(self, part: MethodPlan) -> MethodPlan:
        """The method that is given the exemplars which a method learns from: mostly itself."""
        return part if part.of is None else next(one for one in self.methods if one.label == part.of)

    def content(self) -> dict[str, Any]:
        """The tables of its TOML file: the inverse of `of`, in the same folder."""
        return {"methods": {part.label: part.table() for part in self.methods}}

    @staticmethod
    def read(path: str | Path) -> Plan:
        """Reads a TOML file.

        Raises:
            ConfigError: It cannot be read, is no TOML, or not a plan: see `of`.
        """
        file = expanded(path)
        return Plan.of(_content(file), file.parent)

    @staticmethod
    def of(content: Mapping[str, Any], folder: str | Path = ".") -> Plan:
        """A plan from the tables of its TOML file.

        Args:
            content: `exemplars`, `meshes`, `seeds`, `output` and `methods`, name -> table. A method's table
                has its options and settings, its own values of the former keys, and a table `apply`; it may
                be of another name if it says `method = "NAME"`.
            folder: where relative paths begin.

        Raises:
            ConfigError: An unknown key or method, a value of a wrong type or out of range, or nothing to do.
        """
        common, tables = _split(content, "methods", KEYS, "the plan")
        if unknown := [key for key in content if key not in (*KEYS, "methods")]:
            raise ConfigError(f"a plan has no key '{unknown[0]}'", suggestion(unknown[0], [*KEYS, "methods"]))
        if not tables:
            raise ConfigError("the plan has no methods", "add a table such as [methods.nca]")
        place = Path(folder).absolute()
        parts = tuple(_method(label, table, common, place) for label, table in tables.items())
        for part in parts:
            _check_first(part, parts)
        return Plan(parts, place)


def _content(file: Path) -> dict[str, Any]:
    """The tables of a TOML file."""
    try:
        if not file.is_file():
            reason = "it is no file" if file.exists() else "there is no such file"
            raise ConfigError(f"cannot read plan '{file}' ({reason})", "check the path")
        if file.stat().st_size > MOST_BYTES:
            raise ConfigError(f"plan '{file}' has more than {MOST_BYTES >> 20} MB", "is it a plan?")
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as e:
        raise ConfigError(f"plan '{file}' is not valid TOML ({e})", "mend the file") from e
    except (OSError, ValueError) as e:  # ValueError: a null byte in the name
        reason = getattr(e, "strerror", None) or e
        raise ConfigError(f"cannot read plan '{file}' ({reason})", "check the path") from e


def _method(label: str, table: Any, common: Mapping[str, Any], folder: Path) -> MethodPlan:
    """A method by its table, which goes before the plan's common values."""
    if not isinstance(table, Mapping):
        raise ConfigError(f"methods.{label} cannot be {table!r}", f"give {TABLES['methods']}")
    own, apply = _split(table, "apply", OWN_KEYS, f"methods.{label}")
    name = own.pop("method", label)
    if name not in methods():
        raise ConfigError(f"there is no method '{name}'", suggestion(name, methods()))
    fit = {key: value for key, value in table.items() if key not in (*OWN_KEYS, "apply")}
    check_options(methods()[name], fit, apply, label, folder)
    check_source(methods()[name], own.get("source"), fit, label)
    plan = MethodPlan(label, name, fit=fit, apply=apply, **{"exemplars": (), **common, **own})
    _check_lists(plan)
    return plan


def _split(
    table: Mapping[str, Any], inner: str, kinds: Mapping[str, Any], place: str
) -> tuple[dict[str, Any], Mapping[str, Any]]:
    """The values of the known keys, checked, and the table `inner`."""
    keys = [key for key in kinds if key in table]
    own = {key: values.read(values.check, table[key], kinds[key], f"{key} of {place}") for key in keys}
    tables = table.get(inner, {})
    if not isinstance(tables, Mapping):
        raise ConfigError(f"{inner} of {place} cannot be {tables!r}", f"give {TABLES[inner]}")
    return own, tables


def _check_lists(plan: MethodPlan) -> None:
    """Refuses a method without exemplars, or meshes that it needs, and seeds out of range."""
    method = methods()[plan.method]
    if not plan.exemplars:
        raise ConfigError(f"methods.{plan.label} has no exemplars", "name some in the list `exemplars`")
    if method.fits_to_mesh and not plan.meshes:
        raise ConfigError(f"{plan.method} needs meshes", "name some in the list `meshes`")
    least, most = SEEDS
    for seed in plan.seeds:
        if not least <= seed <= most:
            raise ConfigError(f"seed {seed} is out of range", f"choose from {least} to {most}")


def _check_first(part: MethodPlan, parts: Sequence[MethodPlan]) -> None:
    """Refuses to learn from runs that will not be there."""
    if part.of is None:
        return
    place = f"methods.{part.label} learns from '{part.of}'"
    earlier = {one.label: one for one in parts[: parts.index(part)]}
    first = earlier.get(part.of)
    if first is None:
        raise ConfigError(f"{place}, which is not before it in the plan", suggestion(part.of, earlier))
    if first.of is not None or methods()[first.method].fits_to_mesh:
        raise ConfigError(f"{place}, which does not learn from exemplars alone", "name one that does")
    if part.source is not None or methods()[part.method].fits_to_mesh:
        raise ConfigError(f"{place} and from something else", "leave out `of`")
    if (part.exemplars, part.seeds) != (first.exemplars, first.seeds):
        raise ConfigError(f"{place}, with other exemplars or seeds", "give both the same")
