"""Command lines to command objects: tyro parses, its boxed complaints become one line."""

from __future__ import annotations

import difflib
import inspect
import io
import re
from collections.abc import Sequence
from contextlib import redirect_stderr
from dataclasses import fields
from typing import Any

from mitex.errors import MitexError


class UsageError(MitexError):
    """A command line that means nothing."""


def parse(command: type, words: Sequence[str], program: str) -> Any:
    """An instance of the dataclass `command`, filled from the words; None after `--help`, which is printed.

    The class's docstring is the text of its help, as it stands.

    Raises:
        UsageError: The words do not fit the command.
    """
    import tyro

    complaint = io.StringIO()
    try:
        with redirect_stderr(complaint):
            return tyro.cli(
                command,
                prog=program,
                description=inspect.cleandoc(command.__doc__ or ""),
                args=list(words),
                config=(tyro.conf.FlagCreatePairsOff,),
            )
    except SystemExit as e:
        if e.code in (0, None):
            return None
        raise UsageError(one_line(complaint.getvalue()), f"see `{program} --help`") from e


def refuse_unknown_options(command: type, words: Sequence[str], whose: str, remedy: str) -> None:
    """Checks the names of all options before anything else is said of a command line.

    Args:
        command: dataclass whose fields are the options.
        words: of the command line.
        whose: whom the options belong to, for the message.
        remedy: what the message advises if no option has a similar name.

    Raises:
        UsageError: a word names an option that the command does not have; the closest one is named.
    """
    options = ["--help", *(f"--{field.name.replace('_', '-')}" for field in fields(command))]
    for word in words:
        name = word.partition("=")[0].replace("_", "-")
        if name.startswith("--") and name not in options:
            close = difflib.get_close_matches(name, options, 1)
            raise UsageError(
                f"{name} is no option of {whose}", f"did you mean {close[0]}?" if close else remedy
            )


def as_options(message: str, command: Any) -> str:
    """A message about a Python call in the words of the command line.

    Messages have arguments in backticks, as `out` and `resume=True`; those that are options of the command
    become --out and --resume.

    Args:
        message: the message.
        command: an instance of its dataclass, or None before it is known.
    """
    names = set() if command is None else {field.name for field in fields(command)}

    def option(match: re.Match[str]) -> str:
        name, value = match[1], match[2]
        if name not in names:
            return match[0]
        return f"--{name.replace('_', '-')}" + (f" {value}" if value not in (None, "True") else "")

    return re.sub(r"`([a-z_]+)(?:=([^`\s]+))?`", option, message)


def one_line(complaint: str) -> str:
    """What tyro says in a box (of Unicode or ASCII strokes), as a phrase; any wording gives one line."""
    lines = [line for line in re.sub(r"\x1b\[[0-9;]*m", "", complaint).splitlines() if line.strip()]
    title = lines[0].strip("╭─╮ ") if lines else ""
    body: list[str] = []
    for line in lines[1:]:
        if not line.strip("│╰╯─- "):  # a rule; what follows the second one is an explanation
            if body:
                break
            continue
        body.append(line[2:].rstrip("│ "))
    if title == "Required options":
        # Names are indented by four, their explanations by more.
        names = [line.split()[0] for line in body if re.match(r" {4}\S", line)]
        return f"{' and '.join(names)} {'is' if len(names) == 1 else 'are'} missing"
    text = " ".join(" ".join(body).split("Got errors:")[0].split()).rstrip(".")
    bad_value = re.match(r"Error parsing (\S+?):.*?('[^']*')\]?$", text)
    if bad_value:
        return f"{bad_value[1]} cannot be {bad_value[2]}"
    return text[:1].lower() + text[1:] or "this command line is not understood"
