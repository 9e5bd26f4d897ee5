"""How much slower a step gets beside other work, as a ratio to its quiet time.

usage: python -m benchmarks.busy [--quick]

The step is VGG-16 forward and backward on four patches of 128 x 128, in processes of their own: alone,
beside one process that keeps a core busy, and two side by side; with threads that follow the free cores, as
fits have them, and without. On a machine that is not quiet to begin with, the ratios are too small.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import time
from contextlib import ExitStack

from rich.console import Console
from rich.table import Table

from benchmarks.nca import cpu

GOAL = 2.5


def step_times(follow: bool, seconds: float) -> list[float]:
    """Times of the steps of the second half of so many seconds [s]."""
    import torch

    from mitex.features import Vgg16
    from mitex.runtime.cores import following_threads

    network = Vgg16()
    images = torch.rand(4, 128, 128, 3, requires_grad=True)
    times, start = [], time.monotonic()
    with following_threads() as threads:
        while time.monotonic() < start + seconds or len(times) < 2:
            if follow:
                threads.look()
            begin = time.monotonic()
            features = network.features(images, ["relu1_1", "relu3_1"]).values()
            torch.stack([f.square().mean() for f in features]).sum().backward()
            times.append(time.monotonic() - begin)
    return times[len(times) // 2 :]


def measured(follow: bool, seconds: float, fits: int, busy: int) -> float:
    """Median time of a step [s] of so many processes beside so many busy ones."""
    command = [sys.executable, "-m", "benchmarks.busy", "--step", str(int(follow)), "--seconds", str(seconds)]
    with ExitStack() as stack:
        for _ in range(busy):
            other = stack.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            stack.callback(other.kill)
        processes = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(fits)]
        return statistics.mean(float(process.communicate()[0]) for process in processes)


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true", help="short runs: shows that it runs")
    parser.add_argument("--step", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, default=40.0, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.step is not None:
        print(statistics.median(step_times(bool(options.step), options.seconds)))
        return
    seconds = 1.0 if options.quick else options.seconds
    table = Table("threads", "alone [s]", "beside a busy process", "two side by side")
    for follow in (False, True):
        alone = measured(follow, seconds, 1, 0)
        ratios = (measured(follow, seconds, fits, busy) / alone for fits, busy in ((1, 1), (2, 0)))
        table.add_row(
            "as many as free cores" if follow else "fixed", f"{alone:.2f}", *(f"{r:.1f} x" for r in ratios)
        )
    console = Console(width=100)
    console.print(cpu())
    console.print(table)
    console.print(f"goal: at most {GOAL} times the quiet time")


if __name__ == "__main__":
    main()
