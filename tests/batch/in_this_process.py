"""Jobs without processes of their own, for tests in which Python's start would take the most time."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import chdir, suppress
from pathlib import Path

from mitex.cli import main

# A PyMeshLab that a thread loads first aborts the process at its exit.
with suppress(ImportError):
    import pymeshlab  # noqa: F401


class InThisProcess:
    """In place of `mitex.batch.process.Process`."""

    pid = os.getpid()

    def __init__(self, words: Sequence[str], folder: Path, *_: object) -> None:
        self.words, self.folder = words, folder

    def stop(self, *_: object) -> None:
        """It cannot be stopped."""

    def wait(self) -> tuple[int, int]:
        with chdir(self.folder):
            return main(self.words), 1000
