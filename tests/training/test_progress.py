"""What a person sees."""

import io
import re
from types import SimpleNamespace

import pytest

from mitex.training import progress
from mitex.training.progress import Progress, clock


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def ticking(monkeypatch):
    """A clock that each look moves on by one second."""
    now = iter(range(10**6))
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: float(next(now))))


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0, "0:00"), (0.2, "0:01"), (59.5, "1:00"), (61, "1:01"), (3600, "1:00:00"), (7325, "2:02:05")],
)
def test_clock(seconds, text):
    assert clock(seconds) == text


def test_quiet_says_nothing(tmp_path, ticking):
    for stream in (io.StringIO(), Terminal()):
        with Progress("nca", tmp_path, 0, 5, quiet=True, stream=stream) as bar:
            bar.update(5, 1.0)
        assert stream.getvalue() == ""


def test_plain_lines_now_and_then_and_at_the_end(tmp_path, ticking):
    stream = io.StringIO()
    with Progress("nca", tmp_path, 10, 110, quiet=False, stream=stream) as bar:
        for step in range(11, 111):
            bar.update(step, 0.5)
    first, *rest = stream.getvalue().splitlines()
    assert first == f"nca continues at step 10 of 110; output in {tmp_path}"
    assert rest == [
        "nca step 40/110, loss 0.5, 1.00 steps/s, 1:10 left",
        "nca step 70/110, loss 0.5, 1.00 steps/s, 0:40 left",
        "nca step 100/110, loss 0.5, 1.00 steps/s, 0:10 left",
        "nca step 110/110, loss 0.5, 1.00 steps/s, 0:00 left",
    ]


def test_slow_steps_are_given_in_seconds(tmp_path, monkeypatch):
    now = iter([0.0, 40.0, 80.0])
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(now)))
    stream = io.StringIO()
    with Progress("nca", tmp_path, 0, 5, quiet=False, stream=stream) as bar:
        bar.update(1, 2.0)
        bar.update(2, 2.0)
    assert stream.getvalue().splitlines()[-1] == "nca step 2/5, loss 2, 40.00 s/step, 2:00 left"


def test_a_terminal_gets_a_bar(tmp_path, ticking, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    with Progress("nca", tmp_path, 0, 4, quiet=False, stream=stream) as bar:
        for step in range(1, 5):
            bar.update(step, 0.25)
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue())
    assert f"output in {tmp_path}" in text
    assert "2/4 loss 0.25 1.00 steps/s 0:02 left" in text
    assert "4/4 loss 0.25 1.00 steps/s 0:00 left" in text


def test_the_bar_ends_with_the_last_step_of_an_interrupted_run(tmp_path):
    stream = Terminal()
    with Progress("nca", tmp_path, 0, 400, quiet=False, stream=stream) as bar:
        for step in range(1, 30):
            bar.update(step, 0.25)
    assert re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue()).rfind("29/400") > 0
