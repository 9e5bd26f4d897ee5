"""Types of the options of `fit` and `apply` that say what a text may name.

`mitex batch` has to know which texts of a plan are files: their paths are relative to the plan, and jobs are
known by what is in them. Of a `Path`, and of a `str` without a mark, a text is a file if there is one of that
name. The choices of a `Literal`, as in `Literal["ao"] | str`, are never files.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, get_args

from mitex.lazy import load
from mitex.suffixes import FIELDS


@dataclass(frozen=True)
class TextOf:
    """What a text may name: a mark in the `Annotated` type of an option.

    Attributes:
        suffixes: of files, in lower case; () if it names none, None if they may have any.
        names: reference to a function that lists what it may name besides files; None if that is not known.
    """

    suffixes: tuple[str, ...] | None = None
    names: str | None = None


PlainText = Annotated[str, TextOf(suffixes=())]  # words, or the name of something that is no file
VectorField = Annotated[str, TextOf(suffixes=FIELDS)]  # a file, a name, or a direction
ExemplarName = Annotated[str, TextOf(names="mitex.exemplar:names")]  # or a file or folder
ModelName = Annotated[str, TextOf(names="mitex.training.locate:bundled_files")]  # or a file or run folder


def may_be_file(text: str, kind: Any) -> bool:
    """Whether an option takes a text for a file if there is one of that name.

    Args:
        text: its value.
        kind: its type, with marks.
    """
    parts = _parts(kind)
    suffixes = [part.suffixes for part in parts if isinstance(part, TextOf) and part.suffixes is not None]
    return text not in parts and all(Path(text).suffix.lower() in allowed for allowed in suffixes)


def is_plain_text(kind: Any) -> bool:
    """Whether an option of a type, with marks, never takes its value for a file."""
    return any(isinstance(part, TextOf) and part.suffixes == () for part in _parts(kind))


def known_names(kind: Any) -> list[str] | None:
    """What an option of a type, with marks, may name besides files; None if that is not known."""
    parts = _parts(kind)
    if Path in parts:
        return []
    names = [part.names for part in parts if isinstance(part, TextOf) and part.names is not None]
    return [name for reference in names for name in load(reference)()] if names else None


def _parts(kind: Any) -> list[Any]:
    """The types, choices and marks that a type is made of."""
    arguments = get_args(kind)
    return [part for argument in arguments for part in _parts(argument)] if arguments else [kind]
