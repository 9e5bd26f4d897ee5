"""The run folder: config.toml, checkpoints, metrics.jsonl and previews of one training."""

import json
import os
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from mitex import __version__
from mitex.errors import CheckpointError, OutputError
from mitex.paths import atomic_write, check_writable, expanded, is_temporary, missing_folders, prepare_folder
from mitex.training.locate import METRICS, has_checkpoint
from mitex.training.locate import NAME as RESULT
from mitex.training.metrics import Metrics
from mitex.training.toml import to_toml

CONFIG = "config.toml"
PREVIEWS = "previews"
DIVERGED = "diverged.json"


def check(out: str | os.PathLike[str] | None, resume: bool = False) -> None:
    """Checks, before any long work, that a run can start or go on in a folder. Creates nothing.

    None stands for no folder, which has nothing to go on from.

    Without `resume` the folder may be missing, empty, or of a run that never reached a checkpoint: that its
    config.toml tells, since other programs write files of the same names.

    Raises:
        OutputError: There is a run already, or other files, or the folder cannot be written to.
        CheckpointError: There is nothing to resume.
    """
    if out is None:
        if resume:
            raise CheckpointError("there is nothing to resume in memory", "name the run folder with `out`")
        return
    folder = expanded(out)
    try:
        begun = has_checkpoint(folder)
        finished = not begun and _is_run(folder) and (folder / RESULT).exists()
        foreign = not begun and folder.is_dir() and not (_is_run(folder) or _is_empty(folder))
    except (OSError, ValueError) as e:  # ValueError: a null byte in the name
        raise OutputError(f"cannot use '{out}' as a run folder ({e})", "name another `out`") from e
    if resume and not begun:
        raise CheckpointError(
            f"there is no checkpoint in '{out}' to resume", "leave out `resume` to start from the beginning"
        )
    if begun and not resume:
        raise OutputError(
            f"'{out}' holds a run already", "add `resume=True` to continue it, or name another `out`"
        )
    if finished:  # by a method that leaves no checkpoint
        raise OutputError(f"'{out}' holds a finished run", "name another `out`")
    if foreign:
        raise OutputError(f"'{out}' holds other files", "name a new or empty folder with `out`")
    check_writable(out)


@contextmanager
def opened(out: str | os.PathLike[str], resume: bool) -> Iterator[tuple[Path, Metrics]]:
    """Checks, makes and locks a run folder; yields its absolute path and its open metrics.jsonl.

    If the run fails before its first step, what was created is removed again.
    """
    check(out, resume)
    created = missing_folders(out)
    folder = prepare_folder(out)
    fresh = [name for name in (METRICS, CONFIG) if not (folder / name).exists()]
    try:
        with Metrics(folder / METRICS) as metrics:
            yield folder, metrics
    except BaseException:
        with suppress(OSError):
            if METRICS in fresh and not _size(folder / METRICS):  # no step was done
                for name in fresh:
                    (folder / name).unlink(missing_ok=True)
                for empty in reversed(created):
                    empty.rmdir()  # refuses when something else is in it
        raise


def prepare(folder: Path, config: Any, metadata: Mapping[str, str]) -> None:
    """Sweeps up after a killed run, and writes config.toml with the tables `run` and `versions` below."""
    with suppress(OSError):
        (folder / DIVERGED).unlink(missing_ok=True)
        for file in [*folder.iterdir(), *(folder / PREVIEWS).glob("*")]:
            if is_temporary(file):
                file.unlink(missing_ok=True)
    with atomic_write(folder / CONFIG) as temporary:
        temporary.write_text(to_toml(config, {"run": metadata, "versions": versions()}), encoding="utf-8")


def check_there(folder: Path) -> None:
    """Checks that the folder of a run is where it was made.

    Raises:
        OutputError: Somebody has removed it: what a write would leave is no run.
    """
    if not (folder / CONFIG).is_file():
        raise OutputError(
            f"the run folder '{folder}' was removed or emptied during the fit", "start the fit again"
        )


def versions() -> dict[str, str]:
    """Versions of Mitex and of what it computes with, read without importing them."""
    numbers = {"mitex": __version__}
    for package in ("torch", "mitsuba", "drjit"):
        try:
            numbers[package] = version(package)
        except PackageNotFoundError:
            numbers[package] = "missing"
    return numbers


def as_json(config: Any) -> dict[str, Any]:
    """The config's values as JSON gives them back (tuples become lists)."""
    return json.loads(json.dumps(asdict(config)))


def _is_run(folder: Path) -> bool:
    """Whether config.toml is one that `prepare` wrote."""
    try:
        content = tomllib.loads((folder / CONFIG).read_text(encoding="utf-8"))
        return isinstance(content["run"], dict) and "mitex" in content["versions"]
    except (OSError, ValueError, KeyError, TypeError):  # missing, not TOML, not ours
        return False


def _is_empty(folder: Path) -> bool:
    """Whether a folder holds nothing, or what a run leaves that is killed before `prepare` is done."""
    return all(is_temporary(file) or (file.name == METRICS and not _size(file)) for file in folder.iterdir())


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0
