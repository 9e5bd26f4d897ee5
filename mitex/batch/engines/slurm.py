"""Jobs of Slurm, through submitit.

Slurm ends a job when its time is over or others go first. Shortly before, submitit gets a signal: the fit
saves its checkpoint, and the job goes back into the queue.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mitex.batch.engines import Engine, WorkerLost
from mitex.batch.task import Outcome, Task, end_processes
from mitex.errors import ConfigError, RuntimeUnavailable
from mitex.optional import optional

FOLDER = "slurm"  # of what submitit keeps, in the batch folder
MINUTES = 24 * 60  # that a job may take, if nobody says otherwise
MOST_RETURNS = 10_000  # of a job into the queue; each goes on from a checkpoint
SEVERAL = ("nodes", "ntasks_per_node")  # options that would start a job more than once, at the same time
LINES = ("setup", "teardown", "srun_args")  # options that submitit takes as lists


class Slurm(Engine):
    """The queue of a Slurm cluster.

    Args:
        options: of sbatch, as KEY=VALUE.
        jobs: how many are in the queue at once; None for all.
        threads: processors of a job.
        cluster: "slurm"; "local" stands in for it on one machine, for tests.

    Raises:
        ConfigError: An option is no KEY=VALUE, or asks for several processes; as a context, submitit knows
            none of that name.
        RuntimeUnavailable: As a context, this is no machine of a Slurm cluster; on submission, Slurm refuses
            the job.
    """

    def __init__(
        self, options: Sequence[str] = (), jobs: int | None = None, threads: int = 1, cluster: str = "slurm"
    ) -> None:
        self._options = dict(map(_option, options))
        self._cluster = cluster
        self.at_once, self.threads = jobs, threads
        self.pause = 2.0 if cluster == "slurm" else 0.1
        self._executor: Any = None

    def __enter__(self) -> Slurm:
        for program in ("sbatch", "srun") if self._cluster == "slurm" else ():
            if shutil.which(program) is None:
                solution = "run this on a machine of the Slurm cluster"
                raise RuntimeUnavailable(f"there is no {program} here", solution)
        self._opened(Path(FOLDER))  # refuses bad options before any work; it writes nothing
        return self

    def submit(self, task: Task) -> _Queued:
        self._executor = self._executor or self._opened(task.folder.path / FOLDER)
        from submitit.core.utils import FailedJobError, FailedSubmissionError

        try:
            return _Queued(self._executor.submit(Requeueable(task)))
        except (FailedJobError, FailedSubmissionError) as e:
            problem = f"Slurm refuses a job ({_last_line(e)})"
            raise RuntimeUnavailable(problem, "mend the options, and type the same command") from e

    def _opened(self, folder: Path) -> Any:
        executor = optional("submitit", "cluster").AutoExecutor(
            folder, cluster=self._cluster, slurm_max_num_timeout=MOST_RETURNS
        )
        try:
            executor.update_parameters(
                timeout_min=MINUTES, cpus_per_task=self.threads, stderr_to_stdout=True, **self._options
            )
        except (NameError, TypeError, ValueError) as e:
            reason = str(e).partition("\n")[0].partition(". ")[0]  # lists of all options follow
            raise ConfigError(
                f"submitit refuses the options of Slurm ({reason})", "mend or leave out the one that it names"
            ) from e
        return executor

    def __exit__(self, *_: object) -> None:
        """Nothing is held."""


@dataclass
class Requeueable:
    """A task that goes back into the queue when Slurm ends it."""

    task: Task

    def __call__(self) -> Outcome:
        return self.task()

    def checkpoint(self) -> Any:
        """Called by submitit, in the midst of the task, before Slurm ends it."""
        import submitit

        end_processes()
        return submitit.helpers.DelayedSubmission(self)


@dataclass
class _Queued:
    job: Any

    def done(self) -> bool:
        return self.job.done()

    def result(self) -> Outcome:
        from submitit.core.utils import FailedJobError, UncompletedJobError

        try:
            return self.job.result()
        except (FailedJobError, UncompletedJobError) as e:
            raise WorkerLost(
                f"job {self.job.job_id} of Slurm ended without a result ({_last_line(e)})"
            ) from e

    def cancel(self) -> None:
        self.job.cancel(check=False)


def _last_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or ["it says nothing"])[-1]


def _option(text: str) -> tuple[str, int | str | list[str]]:
    key, equals, value = text.partition("=")
    if not (equals and key and value):
        raise ConfigError(f"'{text}' is no option of Slurm", "write KEY=VALUE, such as partition=cpu")
    key = key.replace("-", "_")
    if key in SEVERAL:
        raise ConfigError(f"a job is one process, whose {key} cannot be set", "leave that option out")
    if key in LINES:
        return f"slurm_{key}", [value]
    return f"slurm_{key}", int(value) if value.isdecimal() else value
