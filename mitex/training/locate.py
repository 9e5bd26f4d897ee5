"""Finding the files of a model by its name, and reading what they say of themselves, without torch."""

from __future__ import annotations

from pathlib import Path

from safetensors import SafetensorError, safe_open

from mitex.errors import CheckpointError
from mitex.paths import expanded
from mitex.suggestions import suggestion

NAME = "texture.safetensors"  # the result of a fit, in its run folder
CHECKPOINT = "checkpoint.safetensors"
METRICS = "metrics.jsonl"
PREVIOUS = "checkpoint.previous.safetensors"
BUNDLED = Path(__file__).parents[1] / "data" / "models"


def bundled_files() -> dict[str, Path]:
    """The models that ship with Mitex: name -> file."""
    return {path.stem: path for path in sorted(BUNDLED.glob("*.safetensors"))}


def checkpoints(folder: Path) -> list[Path]:
    """The checkpoints in a run folder, the newest first."""
    return [folder / name for name in (CHECKPOINT, PREVIOUS) if (folder / name).is_file()]


def has_checkpoint(folder: Path) -> bool:
    """Whether the run in a folder can go on: one killed as it saves leaves only the previous checkpoint."""
    return bool(checkpoints(folder))


def locate(source: str | Path) -> list[Path]:
    """The files of a model: a run folder's texture and checkpoints, a file, or the bundled one of that name.

    Raises:
        CheckpointError: there is none.
    """
    path = expanded(source)
    try:
        if path.is_dir():
            texture = path / NAME
            files = [*([texture] if texture.is_file() else []), *checkpoints(path)]
            if not files:
                raise CheckpointError(
                    f"there is no model in '{source}'", "name a run folder that has a checkpoint"
                )
            return files
        if path.is_file():
            return [path]
    except (OSError, ValueError) as e:  # ValueError: a null byte in the name
        raise CheckpointError(f"cannot read '{source}' ({e})", "name a model, a file or a run folder") from e
    bundled = bundled_files()
    if str(source) in bundled:
        return [bundled[str(source)]]
    remedy = suggestion(str(source), bundled, f"use a path, or one of {', '.join(bundled) or 'none'}")
    raise CheckpointError(f"there is no model '{source}'", remedy)


def header(file: Path) -> tuple[frozenset[str], dict[str, str]] | None:
    """Names of the tensors and metadata of a safetensors file; None if it is none."""
    try:
        with safe_open(file, "np") as content:
            return frozenset(content.keys()), content.metadata() or {}
    except (SafetensorError, OSError, ValueError):
        return None
