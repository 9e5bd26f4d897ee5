"""Results on disk: computed once, kept under a hash of everything that they follow from."""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import numpy as np

from mitex.cache_entries import limit, touch, trim
from mitex.manifest import is_whole, seal

Result = TypeVar("Result")


def content_key(*parts: object) -> str:
    """A hash of arrays (dtype, shape and content) and of anything else by its `repr`.

    Numbers that follow each other belong into one tuple: by themselves 1, 23 has the key of 12, 3.
    """
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(repr((part.dtype.str, part.shape)).encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
    return digest.hexdigest()[:32]


def cached(
    place: Path,
    compute: Callable[[], Result],
    read: Callable[[Path], Result],
    write: Callable[[Path, Result], None],
    keep: bool = True,
) -> Result:
    """The result kept in the folder `place`, else that of `compute`, which is kept then.

    A cache that cannot be read or written is no error, and neither is one that was damaged, by its manifest:
    the result is computed again. After a new result the cache is trimmed to its `limit`.

    Args:
        place: of this result alone.
        compute: the long computation.
        read: gives the result from a folder that holds what `write` has written, byte for byte.
        write: fills an empty folder, which is renamed afterwards, so that all files appear together.
        keep: whether a computed result is kept; without, nothing is written.

    Raises:
        ConfigError: the limit that the user has set is none.
    """
    most = limit()
    with suppress(OSError):
        if is_whole(place):
            result = read(place)
            touch(place)
            return result
    result = compute()
    if not keep:
        return result
    with suppress(OSError):
        place.parent.mkdir(parents=True, exist_ok=True)
        filling = Path(tempfile.mkdtemp(prefix=".filling-", dir=place.parent))
        try:
            write(filling, result)
            seal(filling)
            shutil.rmtree(place, ignore_errors=True)  # a damaged one
            os.rename(filling, place)
            trim(place, most)
        finally:
            shutil.rmtree(filling, ignore_errors=True)
    return result
