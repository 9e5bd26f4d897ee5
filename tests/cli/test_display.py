"""A command at work shows what it is doing, on terminals and elsewhere."""

import io
import re
import time
from types import SimpleNamespace

import pytest

from mitex.cli import display, main
from mitex.cli.display import FIRST_LINE, LOOK_EVERY
from mitex.progress import announce
from tests.cli.refusals import apply


class Terminal(io.StringIO):
    def isatty(self):
        return True


def plain(stream) -> str:
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue())


def wait_for(stream, text: str) -> None:
    end = time.monotonic() + 20
    while text not in stream.getvalue():
        assert time.monotonic() < end, stream.getvalue()
        time.sleep(0.01)


@pytest.fixture
def quick(monkeypatch):
    """Lines come almost at once."""
    for name in ("FIRST_LINE", "LINE_EVERY", "LOOK_EVERY"):
        monkeypatch.setattr(display, name, 0.01)


def test_a_line_comes_within_two_seconds():
    assert FIRST_LINE + LOOK_EVERY < 2


def test_work_gets_lines_where_there_is_no_terminal(quick):
    stream = io.StringIO()
    with display.progress_display(stream=stream):
        wait_for(stream, "starting\n")
        announce("growing the texture", 3, 8)
        wait_for(stream, "growing the texture, 3 of 8\ngrowing the texture, 3 of 8\n")
        announce("")
        before = stream.getvalue()
        time.sleep(0.1)
        assert stream.getvalue() == before  # a training shows itself
        announce("baking the maps")
        wait_for(stream, "baking the maps\n")


def test_many_short_works_in_a_row_get_a_line(monkeypatch):
    monkeypatch.setattr(display, "FIRST_LINE", 0.3)
    monkeypatch.setattr(display, "LOOK_EVERY", 0.01)
    stream = io.StringIO()
    with display.progress_display(stream=stream):
        for number in range(20):  # none of them takes as long as FIRST_LINE
            announce(f"work {number}")
            time.sleep(0.1)
    assert "work" in stream.getvalue()


def test_short_work_gets_no_line(monkeypatch):
    monkeypatch.setattr(display, "FIRST_LINE", 100.0)
    monkeypatch.setattr(display, "LOOK_EVERY", 0.01)
    stream = io.StringIO()
    with display.progress_display(stream=stream):
        for work in ("reading", "baking", "writing"):
            announce(work)
            time.sleep(0.02)
    assert stream.getvalue() == ""


@pytest.mark.parametrize("kind", [io.StringIO, Terminal])
def test_quiet_shows_nothing(quick, kind):
    stream = kind()
    with display.progress_display(quiet=True, stream=stream):
        announce("growing the texture")
        time.sleep(0.1)
    assert stream.getvalue() == ""


def test_a_terminal_shows_the_work_at_once_and_it_vanishes(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    stream = Terminal()
    with display.progress_display(stream=stream):
        announce("reading bunny.obj")
        announce("growing [the] texture", 3, 8)
    text = plain(stream)
    assert "starting" in text
    assert stream.getvalue().endswith("\x1b[2K")  # the line is erased


def test_the_time_left_follows_the_parts_that_are_done(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(display, "time", SimpleNamespace(monotonic=lambda: now[0]))
    shows = []
    teller = display._Teller(SimpleNamespace(show=lambda *words: shows.append(words), hide=lambda: None))  # pyright: ignore[reportArgumentType]
    for moment, done in ((0.0, 0), (10.0, 5), (16.0, 8)):
        now[0] = moment
        teller("rendering frames", done, 20)
    teller("writing a.mp4", 0, 0)
    assert shows == [
        ("rendering frames", ", 0 of 20"),
        ("rendering frames", ", 5 of 20, 0:30 left"),
        ("rendering frames", ", 8 of 20, 0:24 left"),
        ("writing a.mp4", ""),
    ]


def test_an_error_ends_the_display(quick):
    stream = io.StringIO()
    with pytest.raises(ValueError), display.progress_display(stream=stream):
        raise ValueError
    before = stream.getvalue()
    time.sleep(0.1)
    assert stream.getvalue() == before
    announce("nobody listens")


def test_commands_are_shown_unless_they_are_quiet(files, monkeypatch, capsys, quick):
    """`mitex apply` of a mesh that is read slowly."""
    from mitex.mesh import load

    read = load.read
    monkeypatch.setattr(load, "read", lambda *words: (time.sleep(0.3), read(*words))[1])
    words = apply("--steps 1 --subdivide 0", out="out/a.ply")
    assert main([*words, "--quiet"]) == 0
    assert "reading" not in capsys.readouterr().err
    assert main(words) == 0
    printed = capsys.readouterr()
    assert "reading good.obj\n" in printed.err and printed.out == "out/a.ply\n"
