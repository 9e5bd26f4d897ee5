"""What `mitex batch` adds to each job, beside the same commands one after the other.

usage: python -m benchmarks.batch [--quick]

The jobs are quilted pictures of 64 x 64 texels, which take little more than the program's start. Plan and
commands take turns, so that what else the machine does counts for both.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.nca import cpu

GOAL = 1.0  # of what a job costs beyond its own command [s]
METHOD, EXEMPLAR = "image_quilting", "lava"
SETTINGS = {"size": 64, "exemplar_size": 32, "block": 12}


def seconds(words: list[str]) -> float:
    """Wall time of a command of Mitex [s]."""
    begin = time.monotonic()
    subprocess.run([sys.executable, "-m", "mitex", *words], check=True, stdout=subprocess.DEVNULL)
    return time.monotonic() - begin


def of_commands(folder: Path, count: int) -> float:
    """Mean time of a fit as a plain command [s]."""
    settings = [f"{key}={value}" for key, value in SETTINGS.items()]
    fit = ["fit", METHOD, "--exemplar", EXEMPLAR, "--quiet"]
    times = [
        seconds([*fit, "--seed", str(seed), "--out", str(folder / str(seed)), "--set", *settings])
        for seed in range(count)
    ]
    return statistics.mean(times)


def of_jobs(folder: Path, count: int) -> float:
    """Mean time of a fit as a job of a plan, without the start of `mitex batch` itself [s].

    The same command once more has nothing left to do but to start and to look.
    """
    lines = [f'exemplars = ["{EXEMPLAR}"]', f"seeds = {list(range(count))}", 'output = "none"']
    lines += [f"[methods.{METHOD}]", *(f"{key} = {value}" for key, value in SETTINGS.items())]
    plan = folder / "plan.toml"
    plan.write_text("\n".join(lines) + "\n")
    words = ["batch", str(plan), "--out", str(folder / "batch"), "--jobs", "1", "--quiet"]
    first, again = seconds(words), seconds(words)
    return (first - again) / count


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="two jobs, once: checks that it runs")
    count, rounds = (2, 1) if parser.parse_args().quick else (8, 3)
    table = Table(title=f"{count} fits of {METHOD}")
    for title in ("as commands, s", "as jobs, s", "ratio", "added, s"):
        table.add_column(title, justify="right")
    added = []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            command, job = of_commands(folder, count), of_jobs(folder, count)
        added.append(job - command)
        table.add_row(f"{command:.2f}", f"{job:.2f}", f"{job / command:.2f}", f"{added[-1]:.2f}")
    console = Console()
    console.print(cpu())
    console.print(table)
    console.print(f"added to a job: {statistics.median(added):.2f} s (goal: under {GOAL:g} s)")


if __name__ == "__main__":
    main()
