"""Checks of option values, without any library that is slow to import."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from typing import Any

from mitex.errors import ConfigError
from mitex.training.config import by_key
from mitex.training.values import number_text


def in_range(option: str, value: float | None, low: float, high: float = math.inf) -> None:
    """Refuses a value of an option that is not finite or outside [low, high]; None passes.

    Raises:
        ConfigError: The value is refused.
    """
    if value is None or (math.isfinite(value) and low <= value <= high):
        return
    least, most = number_text(low), number_text(high)
    bounds = f"of at least {least}" if high == math.inf else f"from {least} to {most}"
    raise ConfigError(f"{option} {number_text(value)} is out of range", f"choose a value {bounds}")


def mutually_exclusive(first: str, second: str, condition: bool) -> None:
    """Refuses two options that contradict each other.

    Raises:
        ConfigError: `condition` says that both were given.
    """
    if condition:
        raise ConfigError(f"{first} and {second} contradict each other", "give only one of them")


def reject_unused(option: str, out: Path, condition: bool) -> None:
    """Refuses an option that means nothing for the kind of file, or the folder, to be written.

    Raises:
        ConfigError: `condition` says that it was given for such a file.
    """
    if condition:
        kind = f"{out.suffix} files" if out.suffix else "folders"
        raise ConfigError(f"{option} means nothing for {kind}", "leave it out or change --out")


def reject_idle(given: Mapping[str, Any] | Sequence[str], keys: Container[str], where: str) -> None:
    """Refuses settings that would change nothing.

    Args:
        given: as `set` of `RunOptions`.
        keys: of those that mean nothing.
        where: such as "without words".

    Raises:
        ConfigError: one of them was given.
    """
    idle = [key for key in by_key(given) if key in keys]
    if idle:
        raise ConfigError(f"{', '.join(idle)} means nothing {where}", "leave it out")


def merged_settings(groups: Sequence[Sequence[str]], **flags: object) -> list[str]:
    """All `key=value` words of repeated `--set`, and of the flags that stand for a key (None: not given).

    Raises:
        ConfigError: A key is set twice, to different values.
    """
    words = [word for group in groups for word in group]
    words += [f"{key}={value}" for key, value in flags.items() if value is not None]
    values: dict[str, str] = {}
    for word in words:
        key, _, value = (part.strip() for part in word.partition("="))
        if values.setdefault(key, value) != value:
            raise ConfigError(f"{key} is set to {values[key]} and to {value}", "give it once")
    return words


def check_source(exemplar: str | None, text: str | None, clip: str | None) -> None:
    """Refuses a fit from neither an exemplar nor words, and a model of texts without any.

    Raises:
        ConfigError: it is one of these.
    """
    if exemplar is None and text is None:
        raise ConfigError("--exemplar is missing", "give --exemplar IMAGE, or --text WORDS")
    if clip is not None and text is None:
        raise ConfigError("--clip means nothing without --text", "leave it out")
