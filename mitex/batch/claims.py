"""Who works on a job: claim files that one process alone can make, also in a folder that machines share.

A claim is `claim.N` in the job's folder, made with O_EXCL. Its lines are `host:pid:time:space`, one for each
process at work; the space is where that number is the process's own. It is stale when these are gone, or, on
another host or in another space (a container), when nobody has touched it for a while. Whoever finds the
newest claim stale makes the next one, so that no claim that somebody could hold is removed.
"""

from __future__ import annotations

import os
import socket
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import NamedTuple

STALE_AFTER = 60.0  # without a touch, of another host's claim [s]
SLACK = 2.0  # by which a process may seem to have started after it made its claim [s]


class _Entry(NamedTuple):
    """A line of a claim."""

    host: str
    pid: int
    moment: float  # when it was noted, by the host's clock [s]
    space: str


class Claim:
    """A claim that this process holds until it is released; a context.

    Attributes:
        path: its file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @staticmethod
    def take(folder: Path) -> Claim | None:
        """A claim on the job of a folder; None if another process has one.

        Raises:
            OSError: The folder cannot be written to.
        """
        try:
            numbers = _numbers(folder)
            if any(_is_live(folder / f"claim.{number}") for number in numbers):
                return None
            path = folder / f"claim.{max(numbers, default=-1) + 1}"
            with path.open("x", encoding="utf-8") as file:
                file.write(_line(os.getpid()))
        except FileExistsError:
            return None
        return Claim(path)._confirmed()

    def _confirmed(self) -> Claim | None:
        """Itself, and stale ones are gone; None if somebody made a claim of another number at this moment."""
        others = [other for other in _claims(self.path.parent) if other != self.path]
        if any(map(_is_live, others)):
            self.release()
            return None
        for other in others:
            with suppress(OSError):  # those that stay are stale to everybody
                other.unlink(missing_ok=True)
        return self

    def note(self, pid: int) -> None:
        """Adds a process that works on the job, and may live longer than this one."""
        with self.path.open("a", encoding="utf-8") as file:
            file.write(_line(pid))

    def touch(self) -> bool:
        """Tells that the work goes on; returns False if another process has taken the job over."""
        try:
            os.utime(self.path)
        except FileNotFoundError:
            return False
        except OSError:  # a disk that is away for a moment
            pass
        return True

    def release(self) -> None:
        """Lets others claim the job."""
        with suppress(OSError):
            self.path.unlink(missing_ok=True)

    def __enter__(self) -> Claim:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def holder(folder: Path) -> str | None:
    """Host of the process that works on the job of a folder; None if nobody does.

    Raises:
        OSError: The folder cannot be read now.
    """
    live = [claim for claim in _claims(folder) if _is_live(claim)]
    return _read(live[0])[0].host if live and _read(live[0]) else None


def _numbers(folder: Path) -> list[int]:
    return sorted(int(claim.suffix[1:]) for claim in _claims(folder))


def _claims(folder: Path) -> list[Path]:
    return [path for path in folder.glob("claim.*") if path.suffix[1:].isdigit()]


def _line(pid: int) -> str:
    return f"{socket.gethostname()}:{pid}:{time.time():.2f}:{_space()}\n"


@cache
def _space() -> str:
    """Within which numbers of processes can be compared: this boot of this kernel, and the PID namespace.

    Empty where there is no /proc.
    """
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="utf-8").strip()
        return f"{boot}/{os.stat('/proc/self/ns/pid').st_ino}"
    return ""


def _read(path: Path) -> list[_Entry]:
    """The lines of a claim; half a line is left out."""
    entries = []
    with suppress(OSError, ValueError):
        for line in path.read_text(encoding="utf-8").splitlines(keepends=True):
            host, pid, moment, space = line.rsplit(":", 3)
            if line.endswith("\n"):
                entries.append(_Entry(host, int(pid), float(moment), space.rstrip("\n")))
    return entries


def _is_live(path: Path) -> bool:
    """Whether a process works under a claim, or may do so, as far as one can tell."""
    entries = _read(path)
    if entries and (entries[0].host, entries[0].space) == (socket.gethostname(), _space()):
        return any(_is_running(entry.pid, entry.moment) for entry in entries)
    try:
        return _now(path.parent) - path.stat().st_mtime < STALE_AFTER
    except FileNotFoundError:
        return False
    except OSError:  # a disk that is away for a moment
        return True


def _is_running(pid: int, moment: float) -> bool:
    """Whether the process that had a number at a moment still runs, and not a later one of that number."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        boot = time.time() - time.clock_gettime(time.CLOCK_BOOTTIME)
        started = boot + int(fields[19]) / os.sysconf("SC_CLK_TCK")
        return fields[0] not in "ZX" and started <= moment + SLACK
    except (FileNotFoundError, ProcessLookupError):  # the latter if it ends meanwhile
        return not Path("/proc/self/stat").exists() and _exists(pid)


def _exists(pid: int) -> bool:
    """Whether a process has this number, where there is no /proc."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _now(folder: Path) -> float:
    """The time by the clock of the file system, which may be another machine's."""
    probe = folder / f".now.{os.getpid()}"
    try:
        probe.touch()
        return probe.stat().st_mtime
    except OSError:
        return time.time()
    finally:
        with suppress(OSError):
            probe.unlink(missing_ok=True)
