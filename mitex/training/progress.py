"""What a person sees of a training: a bar on a terminal, now and then a line elsewhere, nothing if quiet."""

import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

from mitex.training.pace import Pace

REFRESH = 0.2  # [s]
LINE_EVERY = 30.0  # [s]


class Progress:
    """Shows step, smoothed loss, speed, time left and the place of the output, on stderr.

    Args:
        title: What is being trained.
        out: Run folder, named at the start.
        step: Steps done before.
        steps: Steps in all.
        quiet: Show nothing.
        stream: Where to; None is stderr.
        cost: What a step costs beside the others, as of `Pace`.
    """

    def __init__(
        self,
        title: str,
        out: Path,
        step: int,
        steps: int,
        quiet: bool,
        stream: TextIO | None = None,
        cost: Callable[[int], float] | None = None,
    ):
        self.title = title
        self.steps = steps
        self._stream = sys.stderr if stream is None else stream
        self._last_shown = time.monotonic()
        self._pace = Pace(step, steps, self._last_shown, cost)
        self._latest: tuple[int, float] | None = None
        self._bar: Any = None
        self._quiet = quiet
        if not quiet:
            verb = f"continues at step {step} of {steps}" if step else f"starts, {steps} steps"
            self._say(f"{title} {verb}; output in {out}")
            if self._stream.isatty():
                self._open_bar(step)

    def update(self, step: int, loss: float) -> None:
        """Reports that `step` steps are done."""
        if self._quiet:
            return
        self._latest = (step, loss)
        now = time.monotonic()
        if now - self._pace.latest >= REFRESH or step == self.steps:
            self._pace.mark(now, step)
        due = REFRESH if self._bar else LINE_EVERY
        if now - self._last_shown >= due or step == self.steps:
            self._last_shown = now
            self._show(step, loss)

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar:
            if self._latest:  # the bar stays on the screen, so it should end with what was reached
                self._show(*self._latest)
            self._bar.stop()

    def _show(self, step: int, loss: float) -> None:
        speed, seconds = self._pace.speed, self._pace.left(step)
        pace = f"{speed:.2f} steps/s" if speed >= 1 or speed == 0 else f"{1 / speed:.2f} s/step"
        left = "?" if seconds is None else clock(seconds)
        if self._bar:
            self._bar.update(self._row, completed=step, loss=f"{loss:.4g}", pace=pace, left=left)
            self._bar.refresh()
        else:
            self._say(f"{self.title} step {step}/{self.steps}, loss {loss:.4g}, {pace}, {left} left")

    def _say(self, line: str) -> None:
        print(line, file=self._stream, flush=True)

    def _open_bar(self, step: int) -> None:
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
        self._row = self._bar.add_task(
            self.title, total=self.steps, completed=step, loss="-", pace="-", left="?"
        )
        self._bar.start()


def clock(seconds: float) -> str:
    """A duration as M:SS or H:MM:SS."""
    whole = math.ceil(seconds)
    hours, minutes, rest = whole // 3600, whole // 60 % 60, whole % 60
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
