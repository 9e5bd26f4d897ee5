"""What a person sees of a training: a bar on a terminal, now and then a line elsewhere."""

import math
import sys
import time
from typing import Any, TextIO

from mitex.training.control import Progress

REFRESH = 0.2  # [s]
LINE_EVERY = 30.0  # [s]


class ProgressDisplay:
    """An `on_step` that shows step, smoothed loss, speed and time left; a context, which ends its bar.

    Args:
        stream: Where to; None is stderr.
    """

    def __init__(self, stream: TextIO | None = None):
        self._stream = sys.stderr if stream is None else stream
        self._last_shown = -math.inf
        self._latest: Progress | None = None
        self._bar: Any = None

    def __call__(self, progress: Progress) -> None:
        begins = not progress.metrics
        if begins:
            self._end()
            if self._stream.isatty():
                self._open_bar(progress)
        self._latest = progress
        now, due = time.monotonic(), REFRESH if self._bar else LINE_EVERY
        if begins:
            self._last_shown = now
        elif now - self._last_shown >= due or progress.step == progress.steps:
            self._last_shown = now
            self._show(progress)

    def __enter__(self) -> "ProgressDisplay":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _end(self) -> None:
        if self._bar:
            if self._latest:  # the bar stays on the screen, so it should end with what was reached
                self._show(self._latest)
            self._bar.stop()
            self._bar = None

    def _show(self, progress: Progress) -> None:
        pace, left = "-", "?"
        if progress.speed and progress.seconds_left is not None:
            slow = progress.speed < 1
            pace = f"{1 / progress.speed:.2f} s/step" if slow else f"{progress.speed:.2f} steps/s"
            left = clock(progress.seconds_left)
        step, steps, loss = progress.step, progress.steps, f"{progress.loss:.4g}"
        if self._bar:
            self._bar.update(self._row, completed=step, loss=loss, pace=pace, left=left)
            self._bar.refresh()
        else:
            line = f"{progress.stage} step {step}/{steps}, loss {loss}, {pace}, {left} left"
            print(line, file=self._stream, flush=True)

    def _open_bar(self, progress: Progress) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
        from rich.progress import Progress as Bar

        self._bar = Bar(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("loss {task.fields[loss]}"),
            TextColumn("{task.fields[pace]}"),
            TextColumn("{task.fields[left]} left"),
            console=Console(file=self._stream),
            auto_refresh=False,
        )
        start = {"total": progress.steps, "completed": progress.step}
        self._row = self._bar.add_task(progress.stage, **start, loss="-", pace="-", left="?")
        self._bar.start()


def clock(seconds: float) -> str:
    """A duration as M:SS or H:MM:SS."""
    whole = math.ceil(seconds)
    hours, minutes, rest = whole // 3600, whole // 60 % 60, whole % 60
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
