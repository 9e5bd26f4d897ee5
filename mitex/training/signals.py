"""Stopping on Ctrl-C and SIGTERM between two steps rather than inside one."""

import os
import signal
import threading
from contextlib import suppress
from types import FrameType
from typing import Any

NOTICE = b"\nstopping after this step; once more to stop at once\n"


class StopSignals:
    """Context where the first SIGINT or SIGTERM sets `requested`, and the second raises KeyboardInterrupt.

    Outside the main thread, where Python allows no handlers, it does nothing. A signal that the parent
    process asked to ignore (`nohup`, a script's background job) stays ignored. Earlier handlers come back at
    exit.

    Args:
        quiet: Do not answer the first signal on stderr.
    """

    def __init__(self, quiet: bool = True):
        self.requested = False
        self._quiet = quiet
        self._earlier: dict[int, Any] = {}

    def __enter__(self) -> "StopSignals":
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._earlier[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._earlier.items():
            signal.signal(number, handler)
        self._earlier.clear()

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
        if not self._quiet:
            with suppress(OSError):
                os.write(2, NOTICE)  # print() might be what has been interrupted, and cannot be re-entered
