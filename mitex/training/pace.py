"""How fast a training goes, and how long the rest of it will take."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import accumulate

MARKS = 50  # the latest times that the speed is taken from
REFRESH = 0.2  # least time between two of them [s]


class Pace:
    """Speed and time left of a training whose steps may differ in cost.

    Args:
        step: Steps done before.
        steps: Steps in all.
        now: The time [s].
        cost: What a step costs beside the others, by its number from 0; None where all cost the same.
    """

    def __init__(self, step: int, steps: int, now: float, cost: Callable[[int], float] | None = None):
        self._steps = steps
        costs = map(cost, range(steps)) if cost else [1.0] * steps
        self._spent = list(accumulate(costs, initial=0.0))  # on the first so many steps
        self._marks: deque[tuple[float, int]] = deque([(now, step)], maxlen=MARKS)

    def measure(self, now: float, step: int) -> dict[str, float]:
        """`speed` and `seconds_left` of a `Progress` with so many steps done; empty if no time has passed."""
        if now - self._marks[-1][0] >= REFRESH or step == self._steps or len(self._marks) == 1:
            self.mark(now, step)
        left = self.left(step)
        return {} if left is None else {"speed": self.speed, "seconds_left": left}

    def mark(self, now: float, step: int) -> None:
        """Notes that `step` steps are done."""
        self._marks.append((now, step))

    @property
    def speed(self) -> float:
        """Steps per second between the first and the last of the latest marks; 0 if there is but one."""
        (t0, s0), (t1, s1) = self._marks[0], self._marks[-1]
        return (s1 - s0) / (t1 - t0) if t1 > t0 else 0.0

    def left(self, step: int) -> float | None:
        """Time that the steps after the first `step` will take [s]: their cost at the pace of late.

        None before there is a pace.
        """
        (t0, s0), (t1, s1) = self._marks[0], self._marks[-1]
        spent = self._spent[s1] - self._spent[s0]
        left = self._spent[self._steps] - self._spent[step]
        return left * (t1 - t0) / spent if spent > 0 and t1 > t0 else None
