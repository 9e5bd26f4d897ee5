"""A config as TOML: flat values and one level of tables."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import tomli_w


def to_toml(config: Any, tables: Mapping[str, Mapping[str, object]] | None = None) -> str:
    """Writes a flat dataclass as TOML, with extra tables below; numbers read back to the same bits.

    TOML has no null, so None becomes the string "none", which `resolve` reads back.

    Args:
        config: Dataclass of int, float, str, bool, None, and tuples of these.
        tables: Name to flat mapping.

    Raises:
        TypeError: A value is of another type.
        ValueError: A number is not finite.
    """
    return tomli_w.dumps(
        _plain(asdict(config)) | {name: _plain(table) for name, table in (tables or {}).items()}
    )


def _plain(values: Mapping[str, object]) -> dict[str, object]:
    return {name: _value(value) for name, value in values.items()}


def _value(value: object) -> object:
    if value is None:
        return "none"
    if isinstance(value, (tuple, list)):
        return [_value(item) for item in value]
    if not isinstance(value, (bool, int, float, str)):
        raise TypeError(f"no TOML for a {type(value).__name__}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{value} in a config")
    return value
