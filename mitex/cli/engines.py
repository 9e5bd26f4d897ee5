"""The options of commands that run jobs: where, and how many at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import UseAppendAction, arg

from mitex.errors import ConfigError
from mitex.methods.checks import in_range

if TYPE_CHECKING:
    from mitex.batch import Engine

MOST = 4096  # jobs at once, and threads of one


class BatchIncomplete(ConfigError):
    """Some jobs of a batch are not done."""


@dataclass(kw_only=True)
class JobOptions:
    """Where jobs run, for the commands that have any."""

    jobs: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 1; Slurm: all)")] = None
    """Jobs at once."""

    threads: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: a share)")] = None
    """Threads of a job; by default the machine's cores are shared evenly."""

    engine: Annotated[Literal["local", "dask", "slurm"], arg(metavar="local|dask|slurm")] = "local"
    """Where jobs run: on this machine, on a Dask cluster, or as jobs of Slurm."""

    address: Annotated[str | None, arg(metavar="TCP://HOST:PORT", help_behavior_hint="")] = None
    """Scheduler of a Dask cluster; without it one is started here, with a worker for each of --jobs."""

    slurm: Annotated[
        tuple[tuple[str, ...], ...],
        UseAppendAction,
        arg(metavar="KEY=VALUE ...", help_behavior_hint="(repeatable)"),
    ] = ()
    """Options of sbatch, such as partition=cpu."""

    retry: Annotated[bool, arg(help_behavior_hint="")] = False
    """Try jobs again that failed."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def check_jobs(self) -> None:
        """Refuses options out of range, or that contradict each other."""
        in_range("--jobs", self.jobs, 1, MOST)
        in_range("--threads", self.threads, 1, MOST)
        if self.address is not None and self.engine != "dask":
            raise ConfigError("--address means nothing without Dask", "add --engine dask")
        if self.address is not None and self.jobs is not None:
            raise ConfigError("--address and --jobs contradict each other", "the cluster has its workers")
        if self.slurm and self.engine != "slurm":
            raise ConfigError("--slurm means nothing without Slurm", "add --engine slurm")

    def chosen_engine(self) -> Engine:
        """What the options name."""
        if self.engine == "dask":
            from mitex.batch.engines.dask_cluster import Dask

            return Dask(self.address, self.jobs or 1)
        if self.engine == "slurm":
            from mitex.batch.engines.slurm import Slurm

            options = [word for words in self.slurm for word in words]
            return Slurm(options, self.jobs, self.threads or 1)
        from mitex.batch.engines.local import Local

        return Local(self.jobs or 1)


def refuse_missing(missing: int, total: int) -> None:
    """Ends a command some of whose jobs are not done.

    Raises:
        BatchIncomplete: `missing` is not 0.
    """
    if missing:
        raise BatchIncomplete(
            f"{missing} of {total} jobs are not done",
            "mend what failed and add --retry, or type the same command for the rest",
        )
