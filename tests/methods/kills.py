"""Kills the real command again and again: `python -m tests.methods.kills METHOD COUNT FOLDER`.

Kills are aimed at the start of a fit, at the writing of a checkpoint, and at that of the result. After each
one the run folder is looked at, and the fit goes on from what is there. Children are forks of a process that
has imported torch. Any disagreement ends the script with a traceback; its last line says what was done, as
JSON.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from collections import Counter
from pathlib import Path

import torch

from mitex.cli import main
from mitex.methods.registry import methods
from mitex.training import checkpoint
from mitex.training.locate import NAME as RESULT
from mitex.training.locate import has_checkpoint
from tests.methods.fits import FITS, prepare

STEPS = 12
LONGEST = 120.0  # until a kill that was aimed at a file falls [s]
AIMS = {"checkpoint": ".checkpoint.", "result": ".texture."}  # beginnings of temporary files' names


def command(method: str, out: Path) -> list[str]:
    """The words of a fit that begins, or goes on if there is a checkpoint."""
    words = ["fit", method, *FITS[method].fit.split(), "--out", str(out), "--quiet"]
    if not FITS[method].resume:
        return words
    words[words.index("--steps") + 1] = str(STEPS)
    return words + ["--resume"] * (checkpoint_step(out) is not None)


def start(method: str, out: Path) -> int:
    """The number of the process that fits."""
    process = os.fork()
    if process == 0:
        os._exit(main(command(method, out)))
    return process


def checkpoint_step(out: Path) -> int | None:
    """The step of the newest checkpoint that can be read; None if none was written."""
    return checkpoint.load(out).step if has_checkpoint(out) else None


def strike(process: int, out: Path, aim: str, rng: random.Random) -> bool:
    """Kills the process at its aim; whether it had not ended before, as it must have done well."""
    patience = time.monotonic() + (rng.uniform(0.0, 4.0) if aim == "start" else LONGEST)
    while time.monotonic() < patience:
        ended, status = os.waitpid(process, os.WNOHANG)
        if ended:
            assert os.waitstatus_to_exitcode(status) == 0, status
            return False
        if aim in AIMS and out.is_dir() and any(name.startswith(AIMS[aim]) for name in os.listdir(out)):
            time.sleep(rng.uniform(0.0, 0.003))
            break
        time.sleep(0.0005)
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    return True


def check(method: str, out: Path, before: int) -> int:
    """After a kill: no step up to a checkpoint is gone, and a result is whole. Returns that step."""
    step = checkpoint_step(out) or 0
    assert step >= before, (step, before)
    metrics = out / "metrics.jsonl"
    done = metrics.read_bytes().count(b"\n") if metrics.exists() else 0
    assert not FITS[method].resume or done - step <= 1, (done, step)  # a checkpoint follows each step
    if (out / RESULT).exists():
        methods()[method].load_texture().load(out / RESULT)
    return step


def run(method: str, count: int, folder: Path) -> dict[str, int]:
    """Kills so often, in folder after folder; returns how many kills fell at each aim."""
    prepare(folder)
    os.chdir(folder)
    torch.set_num_threads(1)
    if source := FITS[method].source:
        assert os.waitpid(start(source, folder / "runs" / source), 0)[1] == 0
    rng, kills, number, step = random.Random(0), Counter(), 0, 0
    while sum(kills.values()) < count:
        out = folder / f"run{number}"
        aim = rng.choice(["start", "checkpoint", "checkpoint", "result"])
        process = start(method, out)
        if strike(process, out, aim, rng):
            kills[aim] += 1
            step = check(method, out, step)
            if not FITS[method].resume and (out / RESULT).exists():  # it was finished, and stays
                number += 1
        else:
            check(method, out, step)
            number, step = number + 1, 0
    return dict(kills)


if __name__ == "__main__":
    print(json.dumps(run(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))))
