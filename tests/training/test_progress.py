"""What a person sees."""

import io
import re
from types import SimpleNamespace

import pytest

from mitex.training import control, progress
from mitex.training.control import Pace, Progress
from mitex.training.progress import ProgressDisplay, clock


class Terminal(io.StringIO):
    def isatty(self):
        return True


def at(step, steps, loss=0.5, **measured):
    return Progress("nca", step, steps, loss, {"loss": loss}, **measured)


def show(stream, reports, first=0):
    with ProgressDisplay(stream) as display:
        display(Progress("nca", first, reports[0].steps, float("nan")))
        for report in reports:
            display(report)
    return stream.getvalue()


@pytest.fixture
def ticking(monkeypatch):
    """A clock that each look moves on by one second."""
    for module in (progress, control):
        now = iter(range(10**6))
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda now=now: float(next(now))))


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0, "0:00"), (0.2, "0:01"), (59.5, "1:00"), (61, "1:01"), (3600, "1:00:00"), (7325, "2:02:05")],
)
def test_clock(seconds, text):
    assert clock(seconds) == text


def test_the_pace_is_that_of_the_last_steps(monkeypatch):
    times = iter([0.0, 10.0, *(10.0 + 0.5 * k for k in range(1, 101))])
    monkeypatch.setattr(control, "time", SimpleNamespace(monotonic=lambda: next(times)))
    pace = Pace(20, 200)
    assert pace.measure(21) == {"speed": 0.1, "seconds_left": 1790}  # a slow first step
    measured = [pace.measure(step) for step in range(22, 122)]
    assert measured[-1] == {"speed": 2, "seconds_left": 39.5}


def test_no_pace_before_time_has_passed(monkeypatch):
    monkeypatch.setattr(control, "time", SimpleNamespace(monotonic=lambda: 3.0))
    assert Pace(0, 5).measure(1) == {}


def test_plain_lines_now_and_then_and_at_the_end(ticking):
    pace = Pace(10, 110)
    text = show(io.StringIO(), [at(step, 110, **pace.measure(step)) for step in range(11, 111)], 10)
    assert text.splitlines() == [
        "nca step 40/110, loss 0.5, 1.00 steps/s, 1:10 left",
        "nca step 70/110, loss 0.5, 1.00 steps/s, 0:40 left",
        "nca step 100/110, loss 0.5, 1.00 steps/s, 0:10 left",
        "nca step 110/110, loss 0.5, 1.00 steps/s, 0:00 left",
    ]


def test_slow_steps_are_given_in_seconds():
    text = show(io.StringIO(), [at(5, 5, speed=0.025, seconds_left=120.0)])
    assert text == "nca step 5/5, loss 0.5, 40.00 s/step, 2:00 left\n"


def test_a_terminal_gets_a_bar(ticking, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("TERM", "xterm")
    pace = Pace(0, 4)
    text = show(Terminal(), [at(step, 4, 0.25, **pace.measure(step)) for step in range(1, 5)])
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)
    assert "2/4 loss 0.25 1.00 steps/s 0:02 left" in text
    assert "4/4 loss 0.25 1.00 steps/s 0:00 left" in text


def test_the_bar_ends_with_the_last_step_of_an_interrupted_run():
    text = show(Terminal(), [at(step, 400, speed=1.0, seconds_left=9.0) for step in range(1, 30)])
    assert re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text).rfind("29/400") > 0


def test_each_stage_gets_a_bar_of_its_own(monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    stream = Terminal()
    with ProgressDisplay(stream) as display:
        for stage, steps in (("plain_field", 3), ("nerf", 7)):
            display(Progress(stage, 0, steps, float("nan")))
            display(Progress(stage, steps, steps, 0.5, {"loss": 0.5}, speed=1.0, seconds_left=0.0))
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue())
    assert 0 < text.find("3/3") < text.find("7/7")
