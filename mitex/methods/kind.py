"""Which method a model file or a run folder is of, and the models that ship with Mitex."""

from __future__ import annotations

from pathlib import Path

from safetensors import SafetensorError, safe_open

from mitex.methods import NAMES

DEFAULT = "nca"  # names of no model, and files that do not say what they are
BUNDLED = Path(__file__).parents[1] / "data" / "models"


def bundled(method: str) -> dict[str, Path]:
    """The models of a method that ship with Mitex: name -> file."""
    return {path.stem: path for path in sorted(BUNDLED.glob("*.safetensors")) if kind(path) == method}


def kind(source: str | Path) -> str:
    """One of `NAMES`: what the file, any of the run folder, or the model of that name says."""
    path = Path(source).expanduser()
    try:
        if not path.exists() and (shipped := BUNDLED / f"{source}.safetensors").is_file():
            path = shipped
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
