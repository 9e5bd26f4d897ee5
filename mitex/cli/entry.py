"""`main`: finds the command, runs it, and keeps the contract of exit codes.

0 done; 2 bad input or usage, with one line `error: what is wrong; what to do` on stderr; 130 interrupted,
with what could be saved saved; anything else that escapes is a bug and shows its traceback (exit code 1).
"""

from __future__ import annotations

import io
import logging
import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import mitex
from mitex.cli import commands, overview
from mitex.cli.settings import settings_text
from mitex.cli.usage import UsageError, as_options, parse
from mitex.errors import MitexError, MitexWarning
from mitex.runtime.workers import use_one_blas_thread


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command.

    Args:
        argv: Words after `mitex`; the process's own when None.

    Returns:
        The exit code: 0, 2 or 130, or what the command says (`doctor`: 1 if something is missing).
    """
    words = list(sys.argv[1:] if argv is None else argv)
    command = None
    use_one_blas_thread()
    _print_any_name()
    with warnings.catch_warnings():
        _route_warnings()
        try:
            command = _command(words)
            code = 0 if command is None else _run(command)
            sys.stdout.flush()
            return code
        except MitexError as e:
            _say(as_options(f"error: {e}", command))
            return 2
        except KeyboardInterrupt as e:
            # After an interrupt within an `exec` of a text, such as a dataclass's, `python -m` would end by
            # SIGINT whatever is returned here; another `exec` resets that.
            exec("")
            _say(as_options(str(e) or "interrupted", command))
            return 130
        except BrokenPipeError:  # `mitex models | head`: nobody reads on, which is no error
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0


def _command(words: list[str]) -> Any:
    """The command that the words ask for, with its options; None if all they ask for has been printed."""
    if not words:
        raise UsageError("no command given", "see `mitex --help`")
    if words[0] in ("-h", "--help", "help"):
        print(overview.overview())
        return None
    if words[0] in ("-V", "--version"):
        print(f"mitex {mitex.__version__}")
        return None
    if words[1:] and set(words[1:]) <= commands.HELP:
        if words[0] in commands.OF_MODELS:
            print(overview.model_help(words[0]))
            return None
        if commands.lines(words[0]):
            print(overview.group_help(words[0]))
            return None
    if words[0] == "fit" and "--settings" in words:
        print(settings_text(words[1:]))
        return None
    call = commands.find(words)
    return parse(call.command, call.words, call.program)


def _run(command: Any) -> int:
    """Runs a command, with what it is at and what Mitex logs as lines on stderr, but for --quiet."""
    from mitex.cli.display import progress_display
    from mitex.runtime.signals import terminable

    log, lines, quiet = logging.getLogger("mitex"), _LogLines(), getattr(command, "quiet", False)
    level = log.level
    log.addHandler(lines)
    log.setLevel(logging.WARNING if quiet else logging.INFO)
    try:
        with terminable(), progress_display(quiet):
            return command.run() or 0
    finally:
        log.setLevel(level)
        log.removeHandler(lines)


def _print_any_name() -> None:
    """File names may hold what the encoding of stdout or stderr lacks: it is shown escaped."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


class _LogLines(logging.Handler):
    """Log records as lines on stderr, unbuffered: one may come from a signal handler inside of a print."""

    def emit(self, record: logging.LogRecord) -> None:
        with suppress(OSError):
            os.write(2, f"{self.format(record)}\n".encode(errors="backslashreplace"))


def _route_warnings() -> None:
    """Mitex's warnings become lines on stderr, each but once; those of libraries are dropped (python -W shows
    them)."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    warnings.simplefilter("always", MitexWarning)
    others, shown = warnings.showwarning, set()

    def show(message, category, filename, lineno, file=None, line=None):
        if issubclass(category, MitexWarning):
            if str(message) not in shown:
                shown.add(str(message))
                _say(f"warning: {message}")
        else:
            others(message, category, filename, lineno, file, line)

    warnings.showwarning = show


def _say(text: str) -> None:
    print(" ".join(text.split()), file=sys.stderr, flush=True)
