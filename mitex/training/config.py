"""Resolving a config from a preset, a TOML file and `key=value` settings."""

import difflib
import tomllib
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

from mitex.errors import ConfigError
from mitex.training import values

Config = TypeVar("Config")

RECORD_TABLES = ("run", "versions")  # what a run folder's config.toml tells besides the config


def resolve(
    presets: Mapping[str, Config],
    preset: str | None = None,
    file: Path | None = None,
    overrides: Mapping[str, Any] | Sequence[str] = (),
) -> Config:
    """Builds a config: the preset's values, then those of the file, then the overrides, checked together.

    Args:
        presets: Configs by name, all of one dataclass; the first is the default.
        preset: Name of the preset; None leaves the choice to `preset` in the overrides or the file.
        file: TOML file with any subset of the keys, or a run folder's config.toml.
        overrides: values by key, for any keys; or `key=value` texts, in which lists have commas and `none`
            stands for None. Values that are texts are read in the same way.

    Returns:
        A new config of the presets' class, whose own `__post_init__` has checked it.

    Raises:
        ConfigError: An unknown key or preset (the closest match is named), a value of the wrong type, not
            finite or out of range, an unreadable file, or a preset that contradicts the file's.
    """
    kinds = _kinds(next(iter(presets.values())))
    changes = {} if file is None else _from_file(Path(file), kinds)
    if preset is not None and changes.get("preset", preset) != preset:
        raise ConfigError(
            f"preset '{preset}' contradicts preset '{changes['preset']}' in '{file}'",
            "leave out one of the two",
        )
    changes |= {key: _read(key, value, kinds, _value) for key, value in by_key(overrides).items()}
    name = changes.get("preset", preset) or next(iter(presets))
    if name not in presets:
        raise ConfigError(f"there is no preset '{name}'", f"use {_choices(name, presets)}")
    return replace(presets[name], **(changes | {"preset": name}))  # type: ignore[type-var]


def by_key(overrides: Mapping[str, Any] | Sequence[str]) -> dict[str, Any]:
    """Settings by key, from such or from `key=value` texts, of which the last one counts.

    Raises:
        ConfigError: A text is no setting.
    """
    return dict(overrides if isinstance(overrides, Mapping) else map(_split, overrides))


def _kinds(example: Any) -> dict[str, Any]:
    hints = typing.get_type_hints(type(example))
    return {field.name: hints[field.name] for field in fields(example)}


def _split(setting: str) -> tuple[str, str]:
    key, equals, text = setting.partition("=")
    if not equals or not key.strip():
        raise ConfigError(f"'{setting}' is not a setting", "write key=value")
    return key.strip(), text.strip()


def _value(value: Any, kind: Any) -> Any:
    return values.parse(value, kind) if isinstance(value, str) else values.check(value, kind)


def _from_file(file: Path, kinds: Mapping[str, Any]) -> dict[str, Any]:
    try:
        with file.open("rb") as stream:
            content = tomllib.load(stream)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as e:
        raise ConfigError(f"'{file}' is not valid TOML ({e})", "mend the file") from e
    except (OSError, ValueError) as e:  # ValueError: a null byte in the name
        reason = getattr(e, "strerror", None) or e
        raise ConfigError(f"cannot read config '{file}' ({reason})", "check the path") from e
    for table in RECORD_TABLES:
        if isinstance(content.get(table), dict):
            del content[table]
    return {key: _read(key, value, kinds, values.check) for key, value in content.items()}


def _read(key: str, value: Any, kinds: Mapping[str, Any], reader: Callable[[Any, Any], Any]) -> Any:
    if key not in kinds:
        raise ConfigError(f"there is no key '{key}'", f"use {_choices(key, kinds)}")
    try:
        return reader(value, kinds[key])
    except ValueError as e:
        raise ConfigError(f"{key} cannot be {value!r}", f"give {values.describe(kinds[key])}") from e


def _choices(wrong: str, names: Iterable[str]) -> str:
    """The closest name, or all of them when none is close."""
    names = list(names)
    close = difflib.get_close_matches(wrong, names, n=1, cutoff=0.6)
    return f"'{close[0]}'" if close else "one of " + ", ".join(names)
