"""How fast a training goes, and how long the rest of it will take."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import accumulate

MARKS = 50  # the latest times that the speed is taken from


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

    @property
    def latest(self) -> float:
        """The time of the latest mark [s]."""
        return self._marks[-1][0]

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
        return (self._spent[self._steps] - self._spent[step]) * (t1 - t0) / spent if spent > 0 else None
