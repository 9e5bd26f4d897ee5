"""Ctrl-C and SIGTERM: stopping between two steps rather than inside one, and where nothing is harmed."""

import logging
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, ClassVar

log = logging.getLogger(__name__)


def signal_name(number: int) -> str:
    """Such as "SIGKILL"; "signal 99" for one that has no name here."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


class StopSignals:
    """Context where the first SIGINT or SIGTERM sets `requested`, and the second raises KeyboardInterrupt.

    Outside the main thread, where Python allows no handlers, it does nothing. A signal that the parent
    process asked to ignore (`nohup`, a script's background job) stays ignored. Earlier handlers come back at
    exit.

    Attributes:
        second_raises: whether a second signal does what is said above; without, it changes nothing, for
            processes that are told to stop by more than one other.
    """

    second_raises: ClassVar[bool] = True

    def __init__(self) -> None:
        self.requested = False
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
            if self.second_raises:
                raise KeyboardInterrupt
            return
        self.requested = True
        # The lock of `logging` lets its own thread in again; a handler that writes unbuffered is safe here.
        log.info("stopping after this step; once more to stop at once")


@contextmanager
def deferred() -> Iterator[None]:
    """Context at whose end SIGINT and SIGTERM arrive that came within it.

    For loading an extension, which makes another error of what a handler raises meanwhile. Only in the main
    thread; ignored signals stay ignored.
    """
    came: list[int] = []
    earlier: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                earlier[number] = signal.signal(number, lambda n, _: came.append(n))
    try:
        yield
    finally:
        for number, handler in earlier.items():
            signal.signal(number, handler)
        for number in came[:1]:
            signal.raise_signal(number)


@contextmanager
def terminable() -> Iterator[None]:
    """Context where SIGTERM raises KeyboardInterrupt as Ctrl-C does, so that what is half-written is removed.

    Only in the main thread, and where nobody has asked for something else than the process's end.
    """
    alone = threading.current_thread() is threading.main_thread()
    if not alone or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
