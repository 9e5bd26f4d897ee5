"""Resolving a config from a preset, a TOML file and `key=value` settings."""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from mitex.errors import ConfigError
from mitex.reading import content, reading
from mitex.suggestions import suggestion
from mitex.training import values
from mitex.training.settings import kinds

Config = TypeVar("Config")

LARGEST = 16 << 20  # config file [bytes]
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
            finite or out of range, an unreadable file, or two presets that contradict each other.
    """
    types = kinds(type(next(iter(presets.values()))))
    from_file = {} if file is None else _from_file(Path(file), types)
    from_overrides = {key: _read(key, value, types, _value) for key, value in by_key(overrides).items()}
    places = {"": preset, " in the settings": from_overrides.get("preset")}
    name = _agreed(places | {f" in '{file}'": from_file.get("preset")}) or next(iter(presets))
    if name not in presets:
        raise ConfigError(f"there is no preset '{name}'", suggestion(name, presets))
    return replace(presets[name], **(from_file | from_overrides | {"preset": name}))  # type: ignore[type-var]


def of_record(config: type[Config], record: Mapping[str, Any]) -> Config:
    """The config of the keys that a model or a checkpoint holds; it may hold others, and lack some.

    Raises:
        ValueError: A value of the wrong type, or not finite.
        ConfigError: One out of its range.
    """
    types = kinds(config)
    return config(**{key: values.check(value, types[key]) for key, value in record.items() if key in types})


def _agreed(places: Mapping[str, str | None]) -> str | None:
    """The one preset that all places name, if any."""
    names = {place: name for place, name in places.items() if name is not None}
    first = next(iter(names.values()), None)
    for place, name in names.items():
        if name != first:
            raise ConfigError(
                f"preset '{first}' contradicts preset '{name}'{place}", "leave out one of the two"
            )
    return first


def by_key(overrides: Mapping[str, Any] | Sequence[str]) -> dict[str, Any]:
    """Settings by key, from such or from `key=value` texts, of which the last one counts.

    Raises:
        ConfigError: A text is no setting.
    """
    return dict(overrides if isinstance(overrides, Mapping) else map(_split, overrides))


def _split(setting: str) -> tuple[str, str]:
    key, equals, text = setting.partition("=")
    if not equals or not key.strip():
        raise ConfigError(f"'{setting}' is not a setting", "write key=value")
    return key.strip(), text.strip()


def _value(value: Any, kind: Any) -> Any:
    return values.parse(value, kind) if isinstance(value, str) else values.check(value, kind)


def _from_file(file: Path, types: Mapping[str, Any]) -> dict[str, Any]:
    with reading(file, ConfigError, "check the path"):
        data = content(file, LARGEST)
    with reading(file, ConfigError, "mend the file", "is not valid TOML"):
        settings = tomllib.loads(data.decode())
    for table in RECORD_TABLES:
        if isinstance(settings.get(table), dict):
            del settings[table]
    return {key: _read(key, value, types, values.check) for key, value in settings.items()}


def _read(key: str, value: Any, types: Mapping[str, Any], reader: Callable[[Any, Any], Any]) -> Any:
    if key not in types:
        raise ConfigError(f"there is no key '{key}'", suggestion(key, types))
    return values.read(reader, value, types[key], key)
