"""How many cores are free, and a number of threads that follows it while a training runs.

Threads that share a product wait for each other. Where one of two has no core, as beside other work, every
product takes as long as it takes the system to come round, many times what a single thread needs.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from mitex.runtime import workers

STAT = Path("/proc/stat")
QUOTA = Path("/sys/fs/cgroup/cpu.max")
SPACING = 5.0  # between two looks [s]
IDLE = (3, 4)  # the columns of what nobody used: idle, and waiting for a disk


@dataclass(frozen=True)
class Usage:
    """Processor time since the start of the machine, or of this process [s].

    Attributes:
        when: on the clock.
        everybody: of all processes on the cores that this one may use.
        own: of this one.
    """

    when: float
    everybody: float
    own: float

    @staticmethod
    def now() -> Usage | None:
        """None where the system does not tell, as on macOS."""
        with suppress(OSError, ValueError, AttributeError):
            busy, tick = 0.0, os.sysconf("SC_CLK_TCK")
            allowed = {f"cpu{number}" for number in os.sched_getaffinity(0)}
            for line in STAT.read_text(encoding="ascii").splitlines():
                name, *columns = line.split()
                if name in allowed:
                    ticks = list(map(int, columns))[:8]  # guests are counted in the first two already
                    busy += (sum(ticks) - sum(ticks[k] for k in IDLE)) / tick
            return Usage(time.monotonic(), busy, time.process_time())
        return None

    def left_to_us(self, later: Usage) -> float:
        """How many cores others left between this and a later look; at least 0."""
        seconds = max(later.when - self.when, 1e-3)
        others = (later.everybody - self.everybody - (later.own - self.own)) / seconds
        return max(cores() - max(others, 0.0), 0.0)


def cores() -> float:
    """How many cores this process may use, by its affinity and the quota of its container."""
    try:
        count = float(len(os.sched_getaffinity(0)))
    except AttributeError:
        count = float(os.cpu_count() or 1)
    with suppress(OSError, ValueError):
        quota, period = QUOTA.read_text(encoding="ascii").split()
        count = min(count, int(quota) / int(period))
    return count


def free_cores(seconds: float = 0.5) -> float | None:
    """How many cores other processes leave, looking for so long; None where the system does not tell."""
    before = Usage.now()
    time.sleep(seconds)
    after = Usage.now()
    return None if before is None or after is None else before.left_to_us(after)


class FollowingThreads:
    """Keeps torch's number of threads at that of the cores that others leave, at most what it was before.

    Where the user has set a number (`mitex.runtime.threads`, `OMP_NUM_THREADS`), it stays. Of two trainings
    side by side on two cores each sees one left, and takes one thread. Dr.Jit's workers need not wait for
    each other, and stay as they are.
    """

    def __init__(self) -> None:
        self._torch = import_module("torch")
        self._most = self._torch.get_num_threads()
        fixed = workers.is_set() or "OMP_NUM_THREADS" in os.environ or self._most == 1
        self._before = None if fixed else Usage.now()

    def look(self) -> None:
        """Between two steps: counts anew if some seconds have passed."""
        if self._before is None or time.monotonic() < self._before.when + SPACING:
            return
        after = Usage.now()
        if after is not None:
            self._set(round(self._before.left_to_us(after)))
        self._before = after

    def _set(self, count: int) -> None:
        count = min(max(count, 1), self._most)
        if count != self._torch.get_num_threads():
            self._torch.set_num_threads(count)


@contextmanager
def following_threads() -> Iterator[FollowingThreads]:
    """A context of a training; torch gets back the number of threads that it had."""
    torch = import_module("torch")
    count = torch.get_num_threads()
    try:
        yield FollowingThreads()
    finally:
        if torch.get_num_threads() != count:
            torch.set_num_threads(count)
