"""`python -m mitex.cli.job PARENT PIPE WORDS`: a command of Mitex that does not outlive its parent process.

Before it ends it writes into the pipe how much memory it had.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

from mitex.batch.memory import write_peak
from mitex.cli.entry import main
from mitex.runtime.signals import StopSignals

_PARENT_DEATH_SIGNAL = 1  # prctl(2)


def end_with_parent(parent: int) -> None:
    """Asks Linux for a SIGTERM when the parent ends, be it killed: then a fit saves its checkpoint.

    Args:
        parent: process that started this one; if it is gone already, this one ends.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGTERM)
    if os.getppid() != parent:
        sys.exit(130)


if __name__ == "__main__":
    StopSignals.second_raises = False  # who does not want to wait for a step sends a SIGKILL
    signal.signal(signal.SIGUSR2, signal.SIG_IGN)  # Slurm's warning to the parent, which sends a SIGTERM
    parent, pipe = map(int, sys.argv[1:3])
    os.set_inheritable(pipe, False)
    end_with_parent(parent)
    try:
        sys.exit(main(sys.argv[3:]))
    finally:
        write_peak(pipe)
