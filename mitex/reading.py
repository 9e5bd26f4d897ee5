"""Reading files that others wrote: how much of them is read, and what is said of one that cannot be used."""

from __future__ import annotations

import os
import stat
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from safetensors import SafetensorError

from mitex.errors import MitexError

# What the content of a file can cause where it is parsed. All else is a bug and stays one: a NameError, a
# failed assertion or import.
FAULTS = (
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,
    SyntaxError,  # Pillow's of damaged images
    TypeError,
    ValueError,
    SafetensorError,
    struct.error,
    tokenize.TokenError,  # NumPy's of damaged headers
    zipfile.BadZipFile,
    zlib.error,
)
OF_JSON = (bool, dict, float, int, list, str, type(None))  # whose attributes a file can make us miss
LONGEST = 200  # of a reason, in characters


@contextmanager
def reading(
    path: str | os.PathLike[str],
    error: type[MitexError],
    remedy: str,
    what: str = "cannot be read",
    also: tuple[type[MitexError], ...] = (),
) -> Iterator[None]:
    """The border of a loader: whatever a file causes in the body becomes an error that names the file.

    Args:
        path: of the file.
        error: raised instead, with the reason.
        remedy: what to do then.
        what: said of the file.
        also: errors of Mitex that, in the body, mean no more than that the file is damaged. Others pass.
    """
    try:
        yield
    except (*FAULTS, *also) as e:
        if isinstance(e, error) or (isinstance(e, AttributeError) and type(e.obj) not in OF_JSON):
            raise
        raise error(f"'{path}' {what} ({reason(e)})", remedy) from e


def reason(error: Exception) -> str:
    """What an error says, on one line; with its kind where the message alone says little."""
    text = getattr(error, "strerror", None) or str(error) or "no more is known"
    plain = isinstance(error, OSError | ValueError | MitexError | SafetensorError)
    return " ".join((text if plain else f"{type(error).__name__}: {text}").split())[:LONGEST]


def content(path: str | os.PathLike[str], most: int) -> bytes:
    """What is in a file of at most `most` bytes.

    Raises:
        OSError: it is missing, or cannot be read.
        ValueError: it is larger, or no regular file: a device may be endless, a pipe may wait forever.
    """
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise ValueError("it is no regular file")
    with Path(path).open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise ValueError(f"it has more than {most:,} bytes")
    return data
