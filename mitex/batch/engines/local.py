"""Jobs on this machine, a few at once."""

from __future__ import annotations

import signal
from concurrent.futures import Future, ThreadPoolExecutor

from mitex.batch.engines import Engine
from mitex.batch.task import Outcome, Task, stop_processes
from mitex.runtime.cores import cores


class Local(Engine):
    """A pool of threads, each of which waits for a job's process.

    Args:
        jobs: how many run at once; each has its share of the cores.
    """

    pause = 0.05

    def __init__(self, jobs: int = 1) -> None:
        self.at_once: int | None = jobs
        self.threads = max(1, int(cores() // jobs))
        self._pool = ThreadPoolExecutor(jobs, "job")

    def submit(self, task: Task) -> Future[Outcome]:
        return self._pool.submit(task)

    def __exit__(self, error: type[BaseException] | None, *_: object) -> None:
        # A KeyboardInterrupt in here is the second Ctrl-C: nobody waits for the end of a step any more.
        stop_processes(signal.SIGKILL if error is KeyboardInterrupt else signal.SIGTERM)
        self._pool.shutdown(cancel_futures=True)
