"""Speed and time left, by a clock that the test moves."""

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from mitex.training import loop, train
from mitex.training.control import Control
from mitex.training.pace import Pace
from tests.training.task import SmallConfig, SmallTask

STEPS, CHEAP = 200, 80


def cost(step: int) -> float:
    """Of the first steps, and 16 times as much of the others."""
    return 1.0 if step < CHEAP else 16.0


def seconds(step: int) -> float:
    """How long a step takes, with some unevenness."""
    return 0.1 * cost(step) * (1 + 0.1 * (-1) ** step)


def errors(*how) -> list[float]:
    """For each step after the first two, by how much the estimate of the time left is off."""
    now, off = 0.0, []
    pace = Pace(0, STEPS, now, *how)
    for step in range(1, STEPS):
        now += seconds(step - 1)
        pace.mark(now, step)
        truth = sum(map(seconds, range(step, STEPS)))
        left = pace.left(step)
        assert left is not None
        off.append(abs(left / truth - 1))
    return off[2:]


def test_costs_tell_the_time_left_from_the_first_stage_on():
    assert max(errors(cost)) < 0.2


def test_without_costs_the_first_stage_misleads():
    assert errors()[0] > 0.8


def test_the_speed_is_that_of_late():
    pace = Pace(0, 1000, 0.0)
    assert (pace.speed, pace.left(0)) == (0.0, None)
    for step in range(1, 201):
        pace.mark(float(step) if step <= 100 else 100 + 0.5 * (step - 100), step)
    assert pace.speed == pytest.approx(2.0)
    assert pace.left(200) == pytest.approx(400.0)


def test_a_resumed_training_counts_what_is_left():
    pace = Pace(100, STEPS, 50.0, cost)
    pace.mark(50.0 + 16, 101)
    assert pace.left(101) == pytest.approx(99 * 16)


def test_the_loop_asks_the_task(monkeypatch):
    """In the cheap half, by a clock that each look moves on by a second."""

    @dataclass(frozen=True)
    class Config(SmallConfig):
        steps: int = 100

    class Task(SmallTask):
        def cost(self, step: int) -> float:
            return 1.0 if step < 50 else 16.0

    now, reports = iter(range(10**6)), []
    monkeypatch.setattr(loop, "time", SimpleNamespace(monotonic=lambda: float(next(now))))
    train(Task(), Config(), None, lr=0.01, control=Control(reports.append))
    assert reports[30].step == 30 and reports[30].seconds_left == 20 + 50 * 16
