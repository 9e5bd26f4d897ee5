"""Jobs on a Dask cluster.

Dask counts the death of a worker against every task that was assigned to it, and gives up after a few. Jobs
are processes of their own, so a worker's death says nothing of them: the limit is lifted, where the cluster
is ours, and jobs count their starts themselves.
"""

from __future__ import annotations

from collections import Counter
from concurrent.futures import CancelledError
from dataclasses import dataclass
from typing import Any

from mitex.batch.engines import Engine, WorkerLost
from mitex.batch.task import Outcome, Task
from mitex.errors import ConfigError, RuntimeUnavailable
from mitex.optional import optional
from mitex.runtime.cores import cores

PATIENCE = 10.0  # with a scheduler that does not answer [s]
NO_LIMIT = 1_000_000
SETTINGS = {"distributed.scheduler.allowed-failures": NO_LIMIT, "distributed.comm.timeouts.connect": PATIENCE}


class Dask(Engine):
    """A cluster that is running, or one of processes on this machine.

    Args:
        address: of a scheduler, as tcp://10.0.0.1:8786; None starts a cluster here.
        jobs: how many workers that one has.

    Raises:
        ConfigError: The address is empty; as a context, no scheduler answers.
    """

    pause = 0.1

    def __init__(self, address: str | None = None, jobs: int = 1) -> None:
        if address == "":
            problem = "the address of the Dask scheduler is empty"
            raise ConfigError(problem, "name one, as tcp://10.0.0.1:8786, or leave it out")
        self._address, self._jobs = address, jobs
        self.at_once: int | None = jobs if address is None else None
        self.threads = max(1, int(cores() // jobs))

    def __enter__(self) -> Dask:
        optional("dask.config", "cluster").set(SETTINGS)
        distributed = optional("distributed", "cluster")
        self._cluster = None if self._address else self._local_cluster(distributed)
        try:
            self._client = distributed.Client(self._cluster or self._address, timeout=PATIENCE)
        except (OSError, ValueError) as e:
            raise ConfigError(
                f"no Dask scheduler answers at '{self._address}'", "start one with `dask scheduler`"
            ) from e
        if self._address:
            self.threads = self._share()
        return self

    def _local_cluster(self, distributed: Any) -> Any:
        # Workers are spawned: a fork of a process with Dr.Jit in it would not be safe.
        return distributed.LocalCluster(
            n_workers=self._jobs,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            memory_limit=0,
        )

    def _share(self) -> int:
        """Cores for each task, where they are fewest."""
        workers = self._client.scheduler_info(n_workers=-1)["workers"]
        tasks = Counter[str]()
        for worker in workers.values():
            tasks[worker["host"]] += worker["nthreads"]
        machines: Any = self._client.run(cores)
        shares = (
            int(count // tasks[workers[name]["host"]]) for name, count in machines.items() if name in workers
        )
        return max(1, min(shares, default=1))

    def submit(self, task: Task) -> _Future:
        return _Future(self._client.submit(task, pure=False), self._client)

    def __exit__(self, *_: object) -> None:
        self._client.close(timeout=PATIENCE)
        if self._cluster:
            self._cluster.close(timeout=PATIENCE)


@dataclass
class _Future:
    future: Any
    client: Any

    def done(self) -> bool:
        if self.client.status != "running":
            raise _gone()
        return self.future.done()

    def result(self) -> Outcome:
        from distributed import KilledWorker
        from distributed.comm.core import CommClosedError

        try:
            return self.future.result(timeout=PATIENCE)
        except KilledWorker as e:
            raise WorkerLost("its worker died") from e
        except (CancelledError, CommClosedError, TimeoutError) as e:
            raise _gone() from e

    def cancel(self) -> None:
        self.future.cancel()


def _gone() -> RuntimeUnavailable:
    return RuntimeUnavailable(
        "the Dask scheduler does not answer any more",
        "start it again and type the same command: what is done stays done",
    )
