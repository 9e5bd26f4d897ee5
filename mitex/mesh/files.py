"""Which files a mesh file consists of: itself, material files, textures, buffers."""

from __future__ import annotations

import json
import mmap
import os
import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

from mitex.paths import expanded

_LINE = rb"^[ \t]*(?:%s)[ \t]+(.+?)[ \t\r]*$"
_URI = re.compile(rb'"uri"\s*:\s*"(?!data:)([^"]+)"')
_REFERENCES = {
    ".obj": re.compile(_LINE % b"mtllib", re.MULTILINE),
    ".mtl": re.compile(_LINE % rb"map_\w+|norm|bump|disp|decal|refl", re.MULTILINE | re.IGNORECASE),
    ".ply": re.compile(_LINE % b"comment TextureFile", re.MULTILINE),
    ".gltf": _URI,
    ".glb": _URI,
}


def mesh_files(path: str | os.PathLike[str]) -> list[Path]:
    """A mesh file and the existing files that it refers to; nothing where there is no such file.

    For what must not be overwritten, so rather too many than too few, and damaged files are no error.
    """
    files: dict[Path, None] = {}
    _collect(expanded(path), files)
    return list(files)


def _collect(file: Path, files: dict[Path, None]) -> None:
    if file in files or not os.path.isfile(file):
        return
    files[file] = None
    pattern = _REFERENCES.get(file.suffix.lower())
    for words in _references(file, pattern) if pattern else ():
        for name in _names(words, file.suffix.lower()):
            _collect(file.parent / name, files)


def _references(file: Path, pattern: re.Pattern[bytes]) -> list[str]:
    try:
        with file.open("rb") as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return [match[1].decode("utf-8", "replace") for match in pattern.finditer(data)]
    except (OSError, ValueError):  # unreadable, or empty
        return []


def _names(reference: str, suffix: str) -> Iterator[str]:
    """The names that a reference may mean: options come before a name, and names may hold spaces."""
    if suffix in (".gltf", ".glb"):
        try:
            reference = json.loads(f'"{reference}"')
        except ValueError:
            return
        yield unquote(reference)
        return
    words = reference.replace("\\", "/").split(" ")
    yield from words
    yield from (" ".join(words[k:]) for k in range(len(words) - 1))
