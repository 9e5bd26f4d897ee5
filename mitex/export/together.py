"""Several files that belong together: written all or none, and never over files of others."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path

from mitex.errors import OutputError
from mitex.export.common import GENERATOR, is_png_of_ours
from mitex.export.exr import is_exr_of_ours
from mitex.paths import atomic_write, prepare_output

Inputs = Iterable[str | os.PathLike[str] | None]


def check_files(files: Iterable[Path], whole: str, inputs: Inputs = ()) -> None:
    """Checks that files may be written.

    Args:
        files: their places.
        whole: name of what they are part of, for the message.
        inputs: what the work reads.

    Raises:
        OutputError: one of them exists and is not ours, is one of the inputs, or cannot be written.
    """
    inputs = list(inputs)
    for file in files:
        prepare_output(file, inputs=inputs)
        if os.path.lexists(file) and not is_ours(file):  # a link to nowhere is somebody's, too
            raise OutputError(
                f"'{whole}' comes with '{file}', and a file of that name exists that Mitex did not write",
                "name another place",
            )


def is_ours(path: Path) -> bool:
    """Whether Mitex wrote a file, by the mark in it, and no other program has saved it since."""
    if path.suffix in _MARKED:
        return _MARKED[path.suffix](path)
    try:
        with path.open("rb") as file:
            return file.readline(80).strip() == f"# {GENERATOR}".encode()
    except OSError:
        return False


_MARKED = {".png": is_png_of_ours, ".exr": is_exr_of_ours}


def write_files(files: Mapping[Path, Callable[[Path], object]]) -> None:
    """Writes all files, or none.

    Args:
        files: place -> what writes a file to the path that it is given. The last one, which may refer to the
            others, gets its name last.

    Raises:
        OutputError: the operating system refused.
    """
    with ExitStack() as stack:
        # All are written before the first one gets its name; what is entered first is left last.
        for path, write in reversed(list(files.items())):
            write(stack.enter_context(atomic_write(path)))
