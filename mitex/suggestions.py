"""What to advise who gave a name that there is not."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def suggestion(name: str, names: Iterable[str], otherwise: str | None = None) -> str:
    """Asks for the name that is like `name`, or tells all that there are.

    Args:
        name: that does not exist.
        names: that do.
        otherwise: the advice if none of them is similar, in place of the list.
    """
    names = list(names)
    close = difflib.get_close_matches(name, names, 1)
    if close:
        return f"did you mean {close[0]}?"
    return otherwise or f"use one of {', '.join(names)}"
