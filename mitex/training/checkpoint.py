"""Checkpoints: everything a run needs to go on, in one safetensors file that is replaced in one step."""

import json
import math
import os
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from mitex.errors import CheckpointError, MitexWarning
from mitex.paths import atomic_write
from mitex.reading import reading
from mitex.training import model_file
from mitex.training.locate import CHECKPOINT as NAME
from mitex.training.locate import PREVIOUS, checkpoints

FORMAT = "1"

Value = TypeVar("Value")


@dataclass
class Checkpoint:
    """The state of a run after `step` steps.

    Attributes:
        step: Steps done.
        seconds: Time spent training so far [s].
        loss: Smoothed loss; NaN before the first step.
        skipped: Steps skipped in a row because of a non-finite loss or gradient.
        config: The resolved config, as JSON values by key.
        task: What `Task.state` returned.
        optimizer: What `Adam.state` returned.
        generator: State of the random generator, (N,) uint8.
        metadata: What `Task.metadata` returned.
    """

    step: int
    seconds: float
    loss: float
    skipped: int
    config: dict[str, object]
    task: dict[str, torch.Tensor]
    optimizer: dict[str, torch.Tensor]
    generator: torch.Tensor
    metadata: dict[str, str] = field(default_factory=dict)


def save(folder: Path, checkpoint: Checkpoint) -> Path:
    """Writes `checkpoint.safetensors`, keeping the one before as `checkpoint.previous.safetensors`.

    The new file is complete on disk before the old one is touched, and each change is one rename, so at every
    moment at least one of the two names holds a whole checkpoint. Contiguous CPU tensors are written from
    where they lie, without a copy.

    Raises:
        OutputError: The disk is full or the folder is not writable; the older checkpoints are intact.
    """
    path = folder / NAME
    tensors = {f"task/{k}": v for k, v in checkpoint.task.items()}
    tensors |= {f"optimizer/{k}": v for k, v in checkpoint.optimizer.items()}
    tensors["generator"] = checkpoint.generator
    run = {
        "step": checkpoint.step,
        "seconds": checkpoint.seconds,
        "loss": checkpoint.loss,
        "skipped": checkpoint.skipped,
        "config": checkpoint.config,
    }
    metadata = {"format": "pt", "mitex_checkpoint": FORMAT, "run": json.dumps(run)}
    metadata |= {f"task.{k}": v for k, v in checkpoint.metadata.items()}
    with atomic_write(path) as temporary:
        try:
            save_file({k: v.detach().cpu().contiguous() for k, v in tensors.items()}, temporary, metadata)
        except SafetensorError as e:
            raise _refusal(e) from e
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        if _is_whole(path):  # a damaged one must not take the place of a good one
            os.replace(path, folder / PREVIOUS)
    return path


def load(folder: Path) -> Checkpoint:
    """Reads the newest readable checkpoint of a run folder; warns when that is the previous one.

    Raises:
        CheckpointError: There is none, or none is readable.
    """
    problems = []
    for path in checkpoints(folder):
        try:
            checkpoint = read(path)
        except CheckpointError as e:
            problems.append(e.problem)
            continue
        if problems:
            warnings.warn(
                f"{problems[0]}; going on from the one before, step {checkpoint.step}",
                MitexWarning,
                stacklevel=2,
            )
        return checkpoint
    if problems:
        raise CheckpointError("; ".join(problems), "restore the file or start again with another `out`")
    raise CheckpointError(f"no checkpoint in '{folder}'", "leave out `resume` to start from the beginning")


def read(path: Path) -> Checkpoint:
    """Reads one checkpoint file into memory of its own.

    Raises:
        CheckpointError: It is missing, damaged, or not a Mitex checkpoint.
    """
    with reading(path, CheckpointError, "use another checkpoint"):
        tensors, metadata = model_file.read(path)
        if metadata.get("mitex_checkpoint") != FORMAT:
            raise CheckpointError(
                f"'{path}' is not a checkpoint of this version of Mitex", "name the run folder of a fit"
            )
        return Checkpoint(
            **_counters(json.loads(metadata["run"])),
            task=_under("task/", tensors),
            optimizer=_under("optimizer/", tensors),
            generator=tensors["generator"],
            metadata=_under("task.", metadata),
        )


def _counters(run: dict[str, Any]) -> dict[str, Any]:
    """What a checkpoint says besides its tensors, once it is sure that these are numbers and settings."""
    for key in ("step", "skipped"):
        if type(run[key]) is not int or run[key] < 0:
            raise ValueError(f"{key} = {run[key]!r}")
    if type(run["loss"]) not in (int, float) or not 0 <= float(run["seconds"]) < math.inf:
        raise ValueError("a loss or a time that is no number")
    if not isinstance(run["config"], dict):
        raise ValueError("a config that is none")
    return run


def _is_whole(path: Path) -> bool:
    """Whether a file exists and its header fits its length; the tensors are not read."""
    try:
        with safe_open(path, framework="pt"):
            return True
    except (SafetensorError, OSError):
        return False


def _refusal(error: SafetensorError) -> OSError:
    """The operating system's error inside one of safetensors, which gives it as text only."""
    number = re.search(r"os error (\d+)", str(error))
    return OSError(int(number[1]), os.strerror(int(number[1]))) if number else OSError(str(error))


def _under(prefix: str, items: Mapping[str, Value]) -> dict[str, Value]:
    """The items whose names begin with the prefix, named without it."""
    return {name.removeprefix(prefix): value for name, value in items.items() if name.startswith(prefix)}
