"""Where CLIP models are on a machine. Mitex never downloads one."""

from __future__ import annotations

import os
from pathlib import Path

from mitex.errors import WeightsError
from mitex.paths import expanded

VARIABLE = "MITEX_CLIP"
# Models that people use for textures, the best of this size first: name, licence, size of their files.
PUBLIC = {
    "laion/CLIP-ViT-B-32-DataComp.XL-s13B-b90K": ("MIT", "605 MB"),
    "laion/CLIP-ViT-B-32-laion2B-s34B-b79K": ("MIT", "605 MB"),
    "wkcn/TinyCLIP-ViT-40M-32-Text-19M-LAION400M": ("MIT", "337 MB"),
}


def named_folder(clip: str | os.PathLike[str] | None = None) -> Path | None:
    """The folder that the user names, by an argument or by `MITEX_CLIP`.

    Args:
        clip: the folder; or the name of a public model, ORGANISATION/NAME, that is in Hugging Face's cache.

    Returns:
        The folder, with all files that are needed; None if neither names one.

    Raises:
        WeightsError: it is not there, or files are missing, which are named.
    """
    clip = clip or os.environ.get(VARIABLE) or None
    if clip is None:
        return None
    folder = expanded(clip)
    if not os.path.isdir(folder):
        folder = _snapshot(str(clip)) or folder
    if missing := missing_files(folder):
        what = ", ".join(missing) if os.path.isdir(folder) else "the folder itself"
        raise WeightsError(f"'{clip}' is no CLIP model: missing is {what}", remedy())
    return folder


def cached_folder() -> Path | None:
    """The first of the public models that is whole in Hugging Face's cache, None if there is none."""
    folders = (_snapshot(name) for name in PUBLIC)
    return next((folder for folder in folders if folder and not missing_files(folder)), None)


def missing_files(folder: Path) -> list[str]:
    """Names of the files that a model needs and a folder does not have."""
    missing = [name for name in ("config.json", "model.safetensors") if not (folder / name).is_file()]
    if not (folder / "tokenizer.json").is_file():
        parts = [name for name in ("vocab.json", "merges.txt") if not (folder / name).is_file()]
        missing += ["tokenizer.json (or vocab.json and merges.txt)"] if parts else []
    return missing


def remedy() -> str:
    """What people can do who have no model."""
    models = ", ".join(f"{name} ({licence}, {size})" for name, (licence, size) in PUBLIC.items())
    return f"download one with Hugging Face's tools, such as {models}, and name its folder"


def _snapshot(name: str) -> Path | None:
    """The newest folder of a model in Hugging Face's cache."""
    home = Path(os.environ.get("HF_HOME") or Path.home() / ".cache" / "huggingface")
    cache = Path(os.environ.get("HF_HUB_CACHE") or home / "hub")
    try:
        snapshots = list((cache / f"models--{name.replace('/', '--')}" / "snapshots").iterdir())
        return max(snapshots, key=lambda folder: folder.stat().st_mtime_ns, default=None)
    except OSError:
        return None
