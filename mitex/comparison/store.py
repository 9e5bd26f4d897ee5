"""Measurements on disk: a later call measures only what is new."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from safetensors import safe_open

from mitex.asset import Asset
from mitex.comparison.kinds import Pair
from mitex.comparison.results import LIT, VIEW, Result
from mitex.images import write_image
from mitex.records import write_json
from mitex.training.locate import CHECKPOINT

VERSION = 3  # of what is measured: numbers of another one are measured again
OPTIMIZED = ("optimizer/first/", "optimizer/point")  # tensors of a checkpoint, as large as what is optimized
SUFFIXES = {LIT: ".jpg", VIEW: "-view.jpg"}  # of the files of pictures


class Store:
    """A folder with numbers and pictures of each result, and the numbers of exemplars beside themselves."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def load(self, result: Result, pair: Pair) -> Result | None:
        """The result with its numbers and pictures; None if some are missing, or of another judge or another
        run of its job."""
        files = {kind: self._file(result, suffix) for kind, suffix in SUFFIXES.items()}
        pictures = {kind: file for kind, file in files.items() if file.is_file()}
        numbers = _read(self._file(result, ".json"), pair.judge, result.time)
        has_picture = (VIEW if result.asset is None else LIT) in pictures
        return _with(result, numbers, pictures) if numbers is not None and has_picture else None

    def measure(self, result: Result, pair: Pair) -> Result:
        """The result, measured now and stored.

        Raises:
            MitexError: The asset cannot be read or measured, or the disk is full.
        """
        asset = None if result.asset is None else Asset.load(result.asset)
        numbers = pair.numbers(asset, result.run) | {"parameters": optimized_numbers(result.run)}
        finite = {key: value for key, value in numbers.items() if math.isfinite(value)}
        pictures = {
            kind: write_image(self._file(result, SUFFIXES[kind]), picture)
            for kind, picture in pair.pictures(asset, result.run).items()
        }
        _write(self._file(result, ".json"), finite, pair.judge, result.time)
        return _with(result, finite, pictures)

    def floor(self, pair: Pair) -> dict[str, float]:
        """The numbers of a pair's exemplar beside itself, stored or measured now."""
        path = self.folder / f"exemplar-{pair.key}.json"
        if (numbers := _read(path, pair.judge)) is None:
            numbers = pair.floor()
            _write(path, numbers, pair.judge)
        return numbers

    def _file(self, result: Result, suffix: str) -> Path:
        return self.folder / f"{result.id}{suffix}"


def optimized_numbers(run: Path) -> int:
    """How many numbers a fit has optimized, by its checkpoint; 0 without one."""
    path = run / CHECKPOINT
    if not path.is_file():
        return 0
    with safe_open(path, framework="pt") as file:
        names = [name for name in file.keys() if name.startswith(OPTIMIZED)]  # noqa: SIM118
        return sum(math.prod(file.get_slice(name).get_shape()) for name in names)


def _read(path: Path, judge: str | None, time: str | None = None) -> dict[str, float] | None:
    """Numbers in a file; None if there are none, or they are by another version or judge, or of a result of
    another time."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        if (record["version"], record.get("judge"), record.get("time")) != (VERSION, judge, time):
            return None
        return {key: float(value) for key, value in record["numbers"].items()}
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None


def _write(path: Path, numbers: Mapping[str, float], judge: str | None, time: str | None = None) -> None:
    about = {key: value for key, value in (("judge", judge), ("time", time)) if value}
    write_json(path, {"version": VERSION, "numbers": dict(numbers), **about})


def _with(result: Result, numbers: Mapping[str, float], pictures: Mapping[str, Path]) -> Result:
    return replace(result, numbers={**result.numbers, **numbers}, pictures=pictures)
