"""`mitex batch` and `mitex batch status`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from mitex.cli.engines import JobOptions, refuse_missing


@dataclass(kw_only=True)
class Batch(JobOptions):
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

    def run(self) -> None:
        self.check_jobs()
        from mitex.batch import Plan, run_plan

        plan = Plan.read(self.plan)
        report = run_plan(plan, self.out, self.chosen_engine(), threads=self.threads, retry=self.retry)
        print(report.text())
        print(self.out)
        refuse_missing(len(report.rows) - report.count("done"), len(report.rows))


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
