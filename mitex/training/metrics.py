"""metrics.jsonl: one JSON line per step."""

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mitex.errors import OutputError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None


class Metrics:
    """A file that gets one line per step, unbuffered, so that a killed run keeps its record.

    While it is open it is locked, and with it the run folder; the lock goes with the process.

    Args:
        path: The file; made if missing.

    Raises:
        OutputError: Another process has it open, or it cannot be written; also from the methods.
    """

    def __init__(self, path: Path):
        self.path = path
        with self._translated():
            self._file = path.open("ab", buffering=0)  # a buffer would be written again at close
        if fcntl:
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as e:
                self._file.close()
                raise OutputError(
                    f"another process is training in '{path.parent}'", "wait for it or name another `out`"
                ) from e
            except OSError:
                pass  # a file system without locks

    def __enter__(self) -> "Metrics":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def truncate(self, steps: int) -> None:
        """Cuts off the lines after step `steps`, and half a line at the end."""
        with self._translated():
            length = 0
            with self.path.open("rb") as lines:
                for line in lines:
                    if not line.endswith(b"\n") or _step(line) > steps:
                        break
                    length += len(line)
            self._file.truncate(length)

    def write(self, record: Mapping[str, Any]) -> None:
        """Appends a record; a non-finite number becomes null, as JSON has none."""
        with self._translated():
            line = json.dumps(plain(record)).encode() + b"\n"
            while line:
                line = line[self._file.write(line) :]

    def sync(self) -> None:
        """Makes the lines so far survive a power cut."""
        with self._translated():
            os.fsync(self._file.fileno())

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except OSError as e:
            reason = e.strerror or str(e)
            raise OutputError(
                f"cannot write '{self.path}' ({reason})", "check the folder and the disk"
            ) from e


def losses(path: Path, most: int) -> list[tuple[int, float]]:
    """Steps and losses in a file so far, evenly spread, `most` of them at most; none if there is no file.

    Half a line at the end, which a training is about to write, does not count.
    """
    if not path.is_file():
        return []
    lines = path.read_bytes().split(b"\n")[:-1]
    chosen = lines[:: len(lines) // most + 1]
    return [(row["step"], row["loss"]) for row in map(json.loads, chosen) if row.get("loss") is not None]


def plain(record: Mapping[str, Any]) -> dict[str, Any]:
    """The record with every non-finite number replaced by None."""
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in record.items()}


def _step(line: bytes) -> float:
    """The step of a line; infinite for a line that is none."""
    try:
        return int(json.loads(line)["step"])
    except (ValueError, KeyError, TypeError):
        return math.inf
