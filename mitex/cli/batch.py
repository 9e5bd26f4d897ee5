"""`mitex batch` and `mitex batch status`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, UseAppendAction, arg

from mitex.errors import ConfigError
from mitex.methods.checks import in_range

if TYPE_CHECKING:
    from mitex.batch import Engine

MOST = 4096  # jobs at once, and threads of one


class BatchIncomplete(ConfigError):
    """Some jobs of a batch are not done."""


@dataclass
class Batch:
    """Run a plan: all its exemplars, seeds and meshes with all its methods, each fit a job of its own.

    The same command again goes on: jobs that are done stay, interrupted fits continue from their checkpoints.
    DIR gets the runs and assets in results/, and results.csv. `mitex batch status DIR` tells how far it is.

    examples:
      mitex batch plan.toml --out out/all
      mitex batch plan.toml --out out/all --jobs 4
      mitex batch plan.toml --out out/all --engine dask --address tcp://10.0.0.1:8786
      mitex batch plan.toml --out out/all --engine slurm --slurm partition=cpu time=120 --threads 8
    """

    plan: Annotated[Positional[Path], arg(metavar="PLAN")]
    """TOML file: exemplars, meshes, seeds, and a table for each method."""

    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for everything; all machines must see it."""

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

    def run(self) -> None:
        self._check()
        from mitex.batch import Plan, run_plan

        plan = Plan.read(self.plan)
        report = run_plan(plan, self.out, self._engine(), threads=self.threads, retry=self.retry)
        print(report.text())
        print(self.out)
        missing = len(report.rows) - report.count("done")
        if missing:
            raise BatchIncomplete(
                f"{missing} of {len(report.rows)} jobs are not done",
                "mend what failed and add --retry, or type the same command for the rest",
            )

    def _check(self) -> None:
        in_range("--jobs", self.jobs, 1, MOST)
        in_range("--threads", self.threads, 1, MOST)
        if self.address is not None and self.engine != "dask":
            raise ConfigError("--address means nothing without Dask", "add --engine dask")
        if self.address is not None and self.jobs is not None:
            raise ConfigError("--address and --jobs contradict each other", "the cluster has its workers")
        if self.slurm and self.engine != "slurm":
            raise ConfigError("--slurm means nothing without Slurm", "add --engine slurm")

    def _engine(self) -> Engine:
        if self.engine == "dask":
            from mitex.batch.engines.dask_cluster import Dask

            return Dask(self.address, self.jobs or 1)
        if self.engine == "slurm":
            from mitex.batch.engines.slurm import Slurm

            options = [word for words in self.slurm for word in words]
            return Slurm(options, self.jobs, self.threads or 1)
        from mitex.batch.engines.local import Local

        return Local(self.jobs or 1)


@dataclass
class Status:
    """Tell how far the jobs of `mitex batch` are, and why some failed.

    examples:
      mitex batch status out/all
    """

    folder: Annotated[Positional[Path], arg(metavar="DIR")]
    """What was given as --out."""

    def run(self) -> None:
        from mitex.batch import status

        print(status(self.folder).text())
