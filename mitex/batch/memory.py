"""The most memory that a process had.

Linux's account of a process that has ended begins with the memory of the one that started it. So a job counts
its own, and writes it into a pipe before it ends.
"""

from __future__ import annotations

import os
import resource
import sys
from contextlib import suppress
from pathlib import Path

UNIT = 1 if sys.platform == "darwin" else 1024  # of the system's account [bytes]


def own_peak() -> int:
    """The most memory that this process has had so far [bytes]."""
    with suppress(OSError):  # no /proc
        for line in Path("/proc/self/status").read_text(encoding="utf-8", errors="replace").splitlines():
            name, _, rest = line.partition(":")
            if name == "VmHWM":
                return int(rest.split()[0]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * UNIT


def peak() -> int:
    """The most that this process, or a single one of those that it started and that have ended, has had
    [bytes]."""
    return max(own_peak(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * UNIT)


def write_peak(pipe: int) -> None:
    """Writes `peak` into a pipe, if somebody still reads there."""
    with suppress(OSError):
        os.write(pipe, str(peak()).encode())
