"""`main`: finds the command, runs it, and keeps the contract of exit codes.

0 done; 2 bad input or usage, with one line `error: what is wrong; what to do` on stderr; 130 interrupted,
with what could be saved saved; anything else that escapes is a bug and shows its traceback (exit code 1).
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence

import mitex
from mitex.cli import commands, overview
from mitex.cli.settings import settings_text
from mitex.cli.usage import UsageError, parse
from mitex.errors import MitexError, MitexWarning


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command.

    Args:
        argv: Words after `mitex`; the process's own when None.

    Returns:
        The exit code: 0, 2 or 130, or what the command says (`doctor`: 1 if something is missing).
    """
    words = list(sys.argv[1:] if argv is None else argv)
    with warnings.catch_warnings():
        _route_warnings()
        try:
            code = _run(words)
            sys.stdout.flush()
            return code
        except MitexError as e:
            _say(f"error: {e}")
            return 2
        except KeyboardInterrupt as e:
            _say(str(e) or "interrupted")
            return 130
        except BrokenPipeError:  # `mitex models | head`: nobody reads on, which is no error
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0


def _run(words: list[str]) -> int:
    if not words:
        raise UsageError("no command given", "see `mitex --help`")
    if words[0] in ("-h", "--help", "help"):
        print(overview.overview())
        return 0
    if words[0] in ("-V", "--version"):
        print(f"mitex {mitex.__version__}")
        return 0
    if words[1:] and set(words[1:]) <= commands.HELP:
        if words[0] in commands.OF_MODELS:
            print(overview.model_help(words[0]))
            return 0
        if commands.lines(words[0]):
            print(overview.group_help(words[0]))
            return 0
    if words[0] == "fit" and "--settings" in words:
        print(settings_text(words[1:]))
        return 0
    call = commands.find(words)
    command = parse(call.command, call.words, call.program)
    if command is None:
        return 0
    from mitex.cli.display import shown

    with shown(getattr(command, "quiet", False)):
        return command.run() or 0


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
