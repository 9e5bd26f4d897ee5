"""Which method a model file or a run folder is of."""

from __future__ import annotations

from pathlib import Path

from safetensors import SafetensorError, safe_open

from mitex.methods import NAMES

DEFAULT = "nca"  # models by name, and files that do not say what they are


def kind(source: str | Path) -> str:
    """One of `NAMES`: what the file, or any file of the run folder, finished or not, says."""
    path = Path(source).expanduser()
    try:
        files = sorted(path.glob("*.safetensors")) if path.is_dir() else [path] * path.is_file()
    except (OSError, ValueError):
        return DEFAULT
    return next((name for name in map(_told, files) if name in NAMES), DEFAULT)


def _told(file: Path) -> str:
    """By a model file's format, mitex-METHOD-VERSION, or a checkpoint's metadata."""
    try:
        with safe_open(file, "pt") as content:
            metadata = content.metadata() or {}
    except (SafetensorError, OSError, ValueError):
        return ""
    return metadata.get("task.method") or metadata.get("format", "").removeprefix("mitex-").split("-")[0]
