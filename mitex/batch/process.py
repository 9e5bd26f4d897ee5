"""One command of Mitex in a process of its own, with a share of the machine's threads."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from mitex.batch.memory import UNIT, own_peak
from mitex.runtime.workers import THREADS

THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", THREADS)
KERNELS = "DRJIT_CACHE_DIR"  # Dr.Jit's variable: where it keeps compiled kernels


def environment(threads: int) -> dict[str, str]:
    """The environment of a job: how many threads it has is read when libraries are imported.

    Dr.Jit's kernels are kept on the machine's own disk, since a home that machines share may be slow or lose
    what two of them write at once; where the user has named a place, there.
    """
    variables = dict(os.environ) | dict.fromkeys(THREAD_VARIABLES, str(threads))
    kernels = Path(tempfile.gettempdir()) / f"mitex-{os.getuid()}" / "drjit"
    if _is_own(kernels):
        variables.setdefault(KERNELS, str(kernels))
    if paths := os.environ.get("PYTHONPATH"):  # jobs run in another folder
        variables["PYTHONPATH"] = os.pathsep.join(map(os.path.abspath, filter(None, paths.split(os.pathsep))))
    return variables


class Process:
    """A command that runs.

    Args:
        words: after `mitex`.
        folder: where it runs.
        log: gets all that it prints.
        environment: of it.
    """

    def __init__(
        self, words: Sequence[str], folder: Path, log: IO[bytes], environment: Mapping[str, str]
    ) -> None:
        self._ended, self._sent, self._lock = False, set[int](), threading.RLock()
        read_end, write_end = os.pipe()
        os.set_blocking(read_end, False)
        self._memory_pipe = open(read_end, "rb", buffering=0)  # noqa: SIM115
        try:
            # A group of its own: Ctrl-C reaches this process alone, which passes it on once.
            self._process = subprocess.Popen(
                [sys.executable, "-m", "mitex.cli.job", str(os.getpid()), str(write_end), *words],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env=environment,
                process_group=0,
                pass_fds=[write_end],
            )
        finally:
            os.close(write_end)

    @property
    def pid(self) -> int:
        """Its number."""
        return self._process.pid

    def wait(self) -> tuple[int, int]:
        """Waits for its end; the exit code (negative: the signal) and the most memory that it had [bytes].

        The memory of a process that was killed is 0 if this one has had as much: then it is not known.
        """
        self.await_end()
        with self._lock:  # its number is its own until here
            _, status, usage = os.wait4(self.pid, 0)
            self._ended = True
            self._process.returncode = os.waitstatus_to_exitcode(status)
        return self._process.returncode, self._memory(usage.ru_maxrss * UNIT)

    def _memory(self, system_peak: int) -> int:
        """The peak in its pipe [bytes], or else the system's; 0 where that may be this process's."""
        with self._memory_pipe as pipe:
            own_text = pipe.read(32)
        if own_text or sys.platform == "darwin":
            return int(own_text or system_peak)
        return system_peak if system_peak > own_peak() else 0

    def await_end(self) -> None:
        """Waits for its end, and leaves the exit code to `wait`."""
        os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT)

    def stop(self, number: int = signal.SIGTERM) -> None:
        """Sends it a signal, but none twice; at a SIGTERM a fit ends its step and saves."""
        with self._lock, suppress(ProcessLookupError):
            if not self._ended and number not in self._sent:
                self._sent.add(number)
                os.kill(self.pid, number)


def _is_own(folder: Path) -> bool:
    """Makes a folder that nobody else can write to; whether that worked."""
    try:
        for part in (folder.parent, folder):
            part.mkdir(mode=0o700, exist_ok=True)
        state = folder.parent.lstat()
        return state.st_uid == os.getuid() and not state.st_mode & 0o022
    except OSError:
        return False
