"""What a person sees of a command at work: a line that lives on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol, TextIO, cast

from mitex.progress import announce, listening
from mitex.training.progress import clock

FIRST_LINE = 1.0  # after which work gets a line [s]
LINE_EVERY = 30.0  # between two lines about the same work [s]
LOOK_EVERY = 0.25  # how often it is seen whether a line is due [s]


class _Screen(Protocol):
    def show(self, work: str, details: str) -> None: ...

    def hide(self) -> None: ...


@contextmanager
def progress_display(quiet: bool = False, stream: TextIO | None = None) -> Iterator[None]:
    """Within the context, work that is announced is shown.

    Args:
        quiet: show nothing.
        stream: where to; stderr if None.
    """
    if quiet:
        yield
        return
    place = cast(TextIO, stream or sys.stderr)
    screen: _Screen = _Terminal(place) if place.isatty() else _ReminderLines(place)
    try:
        with listening(_Teller(screen)):
            announce("starting")
            yield
    finally:
        screen.hide()


class _Teller:
    """Puts announcements into words, with an estimate of the time left, and passes them on to a screen."""

    def __init__(self, screen: _Screen):
        self._screen = screen
        self._work, self._began, self._first = "", 0.0, 0

    def __call__(self, work: str, done: int, total: int) -> None:
        now = time.monotonic()
        if work != self._work or done < self._first:
            self._work, self._began, self._first = work, now, done
        if not work:
            self._screen.hide()
            return
        details = f", {done} of {total}" if total else ""
        if done > self._first:
            seconds = (now - self._began) * (total - done) / (done - self._first)
            details += f", {clock(max(seconds, 0.0))} left"
        self._screen.show(work, details)


class _Terminal:
    """One line with the time that has passed, which vanishes at the end."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self._bar: Any = None

    def show(self, work: str, details: str) -> None:
        self._bar = self._bar or self._started(work)
        self._bar.update(self._row, description=work + details)

    def hide(self) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def _started(self, work: str) -> Any:
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        # What is printed meanwhile goes above the line if it goes to a terminal, and else where it belongs.
        bar = Progress(
            SpinnerColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.description}", markup=False),
            console=Console(file=self._stream),
            transient=True,
            redirect_stdout=sys.stdout.isatty(),
        )
        self._row = bar.add_task(work, total=None)
        bar.start()
        return bar


class _ReminderLines:
    """A line once work has taken a while, and again if it goes on; by a thread, since work says nothing."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self._lock = threading.Lock()
        self._work, self._text, self._due = "", "", math.inf
        self._done = threading.Event()
        self._thread: threading.Thread | None = None

    def show(self, work: str, details: str) -> None:
        with self._lock:
            if work != self._work:
                # Many short works in a row get a line too: a new one does not put off one that is due.
                self._due = min(self._due, time.monotonic() + FIRST_LINE)
            self._work, self._text = work, work + details
        if self._thread is None and self._due < math.inf:
            self._done.clear()
            self._thread = threading.Thread(target=self._look, daemon=True)
            self._thread.start()

    def hide(self) -> None:
        self._done.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._work, self._due = "", math.inf

    def _look(self) -> None:
        while not self._done.wait(LOOK_EVERY):
            with self._lock:
                if time.monotonic() >= self._due:
                    self._due = time.monotonic() + LINE_EVERY
                    print(self._text, file=self._stream, flush=True)
