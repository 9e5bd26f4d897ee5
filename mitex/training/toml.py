"""Writing TOML: flat values and one level of tables (tomllib reads them)."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any


def to_toml(config: Any, tables: Mapping[str, Mapping[str, object]] | None = None) -> str:
    """Writes a flat dataclass as TOML, with extra tables below.

    TOML has no null, so None becomes the string "none", which `resolve` reads back.

    Args:
        config: Dataclass of int, float, str, bool, None, and tuples of these.
        tables: Name to flat mapping.

    Raises:
        TypeError: A value is of another type.
        ValueError: A number is not finite.
    """
    lines = [f"{_key(name)} = {_value(value)}" for name, value in asdict(config).items()]
    for table, items in (tables or {}).items():
        lines += ["", f"[{_key(table)}]"]
        lines += [f"{_key(name)} = {_value(value)}" for name, value in items.items()]
    return "\n".join(lines) + "\n"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _string(name)


def _value(value: object) -> str:
    if value is None:
        return '"none"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    raise TypeError(f"no TOML for a {type(value).__name__}")


def _number(value: float) -> str:
    if not math.isfinite(value):
        raise ValueError(f"{value} in a config")
    text = repr(value)  # the shortest text that reads back to the same bits
    mantissa, e, exponent = text.partition("e")
    return mantissa + ("" if "." in mantissa else ".0") + e + exponent


def _string(value: str) -> str:
    # JSON's escapes are TOML's, except that TOML wants DEL escaped and knows no surrogate pairs.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
