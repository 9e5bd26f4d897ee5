"""What jobs read: files by their content, or names of what ships with Mitex."""

from __future__ import annotations

import glob
import hashlib
import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from mitex.errors import ConfigError
from mitex.paths import expanded

LARGEST_FILE = 8 << 30  # [bytes]
PATTERN = "*?["  # characters of names that stand for many


@dataclass(frozen=True)
class Input:
    """A file or folder by its absolute path, or a name that is none.

    Attributes:
        text: as a command takes it.
        path: where it is; None for a name.
    """

    text: str
    path: Path | None

    @staticmethod
    def of(text: str, folder: Path) -> Input:
        """What a text of a plan in `folder` names."""
        path = Path(os.path.abspath(folder / expanded(text)))
        return Input(str(path), path) if text and _exists(path) else Input(text, None)

    @property
    def label(self) -> str:
        """Its name without folder and suffix."""
        if self.path is None:
            return self.text
        return self.path.name if self.path.is_dir() else self.path.stem

    @property
    def key(self) -> str:
        """Its name, and a hash of the content if it has one.

        Raises:
            ConfigError: A file cannot be read.
        """
        return self.text if self.path is None else f"{self.path.name}:{digest(self.path)}"


def find(texts: Iterable[str], folder: Path, kind: str, names: Iterable[str] | None) -> list[Input]:
    """The inputs that the texts of a plan name, in their order; patterns (`photos/*.png`) sorted.

    Args:
        texts: paths, which are relative to `folder`, patterns, or names.
        folder: of the plan.
        kind: "exemplar" or "mesh", for messages.
        names: those that are known; None if that is not to be checked.

    Raises:
        ConfigError: There is no such file or name, or a pattern matches nothing.
    """
    return [one for text in texts for one in _matches(text, folder, kind, names)]


def _matches(text: str, folder: Path, kind: str, names: Iterable[str] | None) -> list[Input]:
    one = Input.of(text, folder)
    if one.path is not None:
        return [one]
    if any(character in text for character in PATTERN):
        paths = sorted(glob.glob(str(folder / expanded(text))))
        if not paths:
            raise ConfigError(f"no {kind} is called '{text}'", f"paths are relative to '{folder}'")
        return [Input.of(path, folder) for path in paths]
    is_path = os.sep in text or Path(text).suffix
    if is_path or not text or (names is not None and text not in set(names)):
        known = f", or name one of {', '.join(names)}" if names else ""
        raise ConfigError(f"there is no {kind} '{text}'", f"paths are relative to '{folder}'{known}")
    return [one]


@cache
def digest(path: Path) -> str:
    """A hash of a file's bytes, or of all files in a folder with their names.

    Raises:
        ConfigError: It cannot be read, is no regular file, or is too large.
    """
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else _parts(path)
    folder_hash = hashlib.sha256()
    for file in files:
        try:
            _check_regular(file)
            with file.open("rb") as stream:
                content = hashlib.file_digest(stream, "sha256").hexdigest()
        except OSError as e:
            raise ConfigError(f"cannot read '{file}' ({e.strerror or e})", "check the file") from e
        folder_hash.update(f"{os.path.relpath(file, path)}\0{content}\n".encode("utf-8", "surrogateescape"))
    return folder_hash.hexdigest()


def _parts(path: Path) -> list[Path]:
    """A file, and the files that it refers to if it is a mesh."""
    from mitex.mesh.files import mesh_files

    return mesh_files(path) or [path]


def _check_regular(file: Path) -> None:
    if not file.is_file():
        raise ConfigError(f"'{file}' is neither a file nor a folder", "name another one")
    if file.stat().st_size > LARGEST_FILE:
        raise ConfigError(f"'{file}' has more than {LARGEST_FILE >> 30} GB", "name a smaller one")


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that is too long, or holds a null byte
        return False
