"""What passes between a running fit and its caller: progress to the one, the wish to stop to the other."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from mitex.training.errors import Cancelled

REFRESH = 0.2  # least time between two measurements of the pace [s]


@dataclass(frozen=True)
class Progress:
    """How far a training is.

    Attributes:
        stage: What is trained: the method's name, or that of a field that it needs first.
        step: Steps done, those of earlier parts of a resumed run included; at the start none is new.
        steps: Steps in all.
        loss: Averaged over about the last 50 steps; NaN before the first.
        metrics: Numbers of the last step, as in metrics.jsonl; empty at the start.
        seconds: Time spent, in earlier parts too [s].
        speed: Steps a second, over the last 50 steps or 10 s, whichever is longer; None at the start.
        seconds_left: Estimate of the time that the remaining steps take [s]; None at the start.
    """

    stage: str
    step: int
    steps: int
    loss: float
    metrics: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    speed: float | None = None
    seconds_left: float | None = None


class Cancel(Protocol):
    """A wish to stop, which any thread may set; `threading.Event` is one."""

    def is_set(self) -> bool:
        """Whether the fit shall stop."""
        ...


@dataclass(frozen=True)
class Control:
    """The caller of a fit.

    Attributes:
        on_step: Is told of the start and of every step, in the fit's own thread. What it raises ends the fit.
        cancel: Is asked before every step.
    """

    on_step: Callable[[Progress], None] | None = None
    cancel: Cancel | None = None

    @property
    def cancelled(self) -> bool:
        """Whether the caller wants the fit to stop."""
        return self.cancel is not None and self.cancel.is_set()

    def check(self) -> None:
        """Stops a preparation, which leaves nothing to go on from.

        Raises:
            Cancelled: The caller wants that.
        """
        if self.cancelled:
            raise Cancelled(None, 0)


ALONE = Control()  # of a fit that nobody watches


class Pace:
    """Measures how fast steps follow each other.

    Args:
        step: Steps done before.
        steps: Steps in all.
    """

    def __init__(self, step: int, steps: int) -> None:
        self._steps = steps
        self._times: deque[tuple[float, int]] = deque([(time.monotonic(), step)], maxlen=50)

    def measure(self, step: int) -> dict[str, float]:
        """`speed` and `seconds_left` of a `Progress` with so many steps done; empty if no time has passed."""
        now = time.monotonic()
        if now - self._times[-1][0] >= REFRESH or step == self._steps or len(self._times) == 1:
            self._times.append((now, step))
        (t0, s0), (t1, s1) = self._times[0], self._times[-1]
        if t1 <= t0:
            return {}
        speed = (s1 - s0) / (t1 - t0)
        return {"speed": speed, "seconds_left": (self._steps - step) / speed}
