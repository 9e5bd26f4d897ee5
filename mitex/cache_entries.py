"""What the user's cache holds, and the limit that it keeps to: what was not used for longest goes first."""

from __future__ import annotations

import math
import os
import re
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mitex.errors import ConfigError
from mitex.paths import cache_dir

VARIABLE = "MITEX_CACHE_GB"  # of the environment: the limit
LIMIT = 2.0  # if it is not set [GB]
IN_USE = 3600.0  # what is unfinished and has been written to within this time stays [s]
# Names of results, and of what is on the way: files being written, and trainings that can be resumed.
_RESULT = re.compile(r"[0-9a-f]{32}")
_UNFINISHED = re.compile(r"\.filling-.*|[0-9a-f]{32}\.run")


@dataclass(frozen=True)
class Entry:
    """A folder in the cache.

    Attributes:
        place: the folder.
        size: of its files [bytes].
        used: when it was last written or read [s since 1970].
    """

    place: Path
    size: int
    used: float


def results(folder: Path | None = None) -> list[Entry]:
    """All results in a cache, the user's if None; those that have not been used for longest first."""
    return _entries(folder or cache_dir(), _RESULT)


def unfinished() -> list[Entry]:
    """What interrupted commands left in the user's cache, and nobody has gone on with for an hour."""
    return [entry for entry in _entries(cache_dir(), _UNFINISHED) if time.time() - entry.used > IN_USE]


def clear() -> list[Entry]:
    """Removes the results and what is unfinished from the user's cache, and returns what is gone.

    Other files stay: those that the user put there, and what is known of this machine.
    """
    every = [*results(), *unfinished()]
    for entry in every:
        shutil.rmtree(entry.place, ignore_errors=True)
    return [entry for entry in every if not entry.place.exists()]


def limit() -> float:
    """How large the cache may be [bytes], by the environment's `MITEX_CACHE_GB`.

    Raises:
        ConfigError: that is no number, or below 0.
    """
    text = os.environ.get(VARIABLE) or str(LIMIT)
    try:
        size = float(text) * 1e9
    except ValueError:
        size = math.nan
    if not size >= 0:
        raise ConfigError(f"{VARIABLE} is '{text}'", "set it to the gigabytes that the cache may take")
    return size


def trim(newest: Path, most: float) -> None:
    """Removes results, those used longest ago first, until a cache has `most` bytes or only the newest.

    Args:
        newest: place of a result, which stays.
        most: the limit.
    """
    entries = results(newest.parents[1])
    size = sum(entry.size for entry in entries)
    for entry in entries:
        if size > most and entry.place != newest:
            shutil.rmtree(entry.place, ignore_errors=True)
            size -= entry.size


def touch(place: Path) -> None:
    """Notes that a result has been used now."""
    with suppress(OSError):
        os.utime(place)


def _entries(folder: Path, names: re.Pattern[str]) -> list[Entry]:
    """The folders of such names, two levels deep, by their time; those that vanish meanwhile are left out."""
    entries = []
    for place in folder.glob("*/*"):
        with suppress(OSError):
            if names.fullmatch(place.name) and place.is_dir():
                size = sum(file.stat().st_size for file in place.rglob("*") if file.is_file())
                entries.append(Entry(place, size, place.stat().st_mtime))
    return sorted(entries, key=lambda entry: entry.used)
