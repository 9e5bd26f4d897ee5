"""What a folder of files holds, by names, sizes and hashes, so that any damage shows."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

NAME = "manifest.json"
LARGEST = 1 << 20  # of a manifest [bytes]


def seal(folder: Path) -> None:
    """Writes the manifest of a folder's files.

    Raises:
        OSError: a file cannot be read, or the manifest not be written.
    """
    (folder / NAME).write_text(json.dumps(_listed(folder), indent=1), encoding="utf-8")


def is_whole(folder: Path) -> bool:
    """Whether a folder holds the files of its manifest, byte for byte, and no others.

    Names, shapes and types of arrays are part of their files, and so of the hashes.

    Raises:
        OSError: a file cannot be read.
    """
    place = folder / NAME
    if not place.is_file() or place.stat().st_size > LARGEST:
        return False
    try:
        manifest = json.loads(place.read_bytes())
    except (ValueError, RecursionError):
        return False
    return (
        isinstance(manifest, dict) and _sizes(folder) == _sizes_of(manifest) and _listed(folder) == manifest
    )


def _sizes(folder: Path) -> dict[str, int]:
    """All files but the manifest."""
    files = sorted(path for path in folder.iterdir() if path.name != NAME)
    return {path.name: path.stat().st_size for path in files}


def _sizes_of(manifest: dict) -> dict[str, object]:
    return {name: entry.get("size") if isinstance(entry, dict) else None for name, entry in manifest.items()}


def _listed(folder: Path) -> dict[str, dict[str, object]]:
    listed = {}
    for name, size in _sizes(folder).items():
        with (folder / name).open("rb") as file:
            listed[name] = {"size": size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}
    return listed
