"""Trains in child processes and kills them: `python -m tests.training.nursery random|everywhere FOLDER`.

Torch is imported once; children are forks of this process, so that each costs milliseconds. Any disagreement
ends the script with a traceback; otherwise its last line tells what was done, as JSON.
"""

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

import torch

from mitex.training import checkpoint, train
from mitex.training.locate import has_checkpoint

from .task import SmallConfig, SmallTask, assert_same_run

EVERY = 2
POOL = 2_000_000  # 8 MB: much of the time goes into writing


def fit(out: Path, steps: int, pool: int) -> None:
    config = SmallConfig(steps=steps, checkpoint_every=EVERY)
    train(SmallTask(pool=pool), config, out, lr=0.01, resume=has_checkpoint(out))


def child(work, *arguments) -> int:
    """Forks a process that does the work; returns its id."""
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            work(*arguments)
            status = 0
        except BaseException as e:
            print(f"child: {e!r}", file=sys.stderr, flush=True)
        os._exit(status)
    return pid


def ended(pid: int) -> bool:
    """Waits; whether the process ended by itself rather than by SIGKILL."""
    _, status = os.waitpid(pid, 0)
    if os.WIFSIGNALED(status):
        assert os.WTERMSIG(status) == signal.SIGKILL
        return False
    assert os.WEXITSTATUS(status) == 0
    return True


def check_loss(out: Path, before: int) -> int:
    """After a kill: at most the steps since the last checkpoint are gone. Returns the checkpoint's step."""
    metrics = out / "metrics.jsonl"
    done = metrics.read_bytes().count(b"\n") if metrics.exists() else 0
    step = checkpoint.load(out).step if has_checkpoint(out) else 0
    assert step >= max(before, (done - 1) // EVERY * EVERY), (step, before, done)
    return step


def await_writing(out: Path, patience: float) -> None:
    """Returns as soon as a temporary file lies in the folder, or after `patience` seconds."""
    began = time.monotonic()
    while time.monotonic() - began < patience and not any(out.glob(".*")):
        time.sleep(1e-4)


def random_kills(folder: Path, kills: int = 25) -> dict:
    """Kills at random moments, every other time once a file is being written; at least one writing is hit."""
    rng = random.Random(5)
    whole = folder / "whole"
    began = time.monotonic()
    assert ended(child(fit, whole, 16, POOL))
    typical = time.monotonic() - began
    report = {"kills": 0, "runs": 0, "leftovers": 0}
    while report["kills"] < kills or not report["leftovers"]:
        out = folder / f"run{report['runs']}"
        step, finished = 0, False
        while not finished:
            pid = child(fit, out, 16, POOL)
            if report["kills"] < kills or not report["leftovers"]:
                if report["kills"] % 2:
                    await_writing(out, patience=typical)
                else:
                    time.sleep(rng.uniform(0, 0.4 * typical))
                os.kill(pid, signal.SIGKILL)
            finished = ended(pid)
            report["kills"] += not finished
            report["leftovers"] += any(out.glob(".*"))
            step = check_loss(out, step)
        assert not list(out.glob(".*"))
        assert_same_run(whole, out)
        report["runs"] += 1
    return report


def die_at(event: int, out: Path) -> None:
    """Makes this process kill itself before its `event`th access to a file of the run or sync."""
    count = 0

    def strike() -> None:
        nonlocal count
        count += 1
        if count == event:
            os.kill(os.getpid(), signal.SIGKILL)

    def hook(name: str, arguments: tuple) -> None:
        if name in ("open", "os.rename", "os.remove", "os.truncate", "os.mkdir") and str(out) in str(
            arguments[0]
        ):
            strike()

    sync = os.fsync

    def fsync(descriptor: int) -> None:
        strike()
        sync(descriptor)

    os.fsync = fsync
    sys.addaudithook(hook)


def kills_everywhere(folder: Path) -> dict:
    """One run for each access to the file system, killed just before it, then resumed."""

    def doomed(event: int, out: Path) -> None:
        die_at(event, out)
        fit(out, 6, 10)

    assert ended(child(fit, folder / "whole", 6, 10))
    event, finished = 0, False
    while not finished:
        event += 1
        out = folder / f"run{event}"
        finished = ended(child(doomed, event, out))
        check_loss(out, 0)
        if not finished:
            assert ended(child(fit, out, 6, 10))
        assert not list(out.glob(".*"))
        assert_same_run(folder / "whole", out)
    return {"kills": event - 1}


if __name__ == "__main__":
    torch.set_num_threads(1)
    fit(Path(sys.argv[2]) / "warm", 2, 10)  # imports everything that a child would import
    print(
        json.dumps({"random": random_kills, "everywhere": kills_everywhere}[sys.argv[1]](Path(sys.argv[2])))
    )
