"""Stopping a command where it calls the library, to see what it hands on."""

from collections.abc import Sequence
from typing import Any

import pytest

from mitex.cli import main


class Reached(Exception):
    """Work would begin now."""


def handed_on(
    monkeypatch: pytest.MonkeyPatch, target: str, words: Sequence[str]
) -> tuple[Sequence[Any], dict[str, Any]]:
    """Arguments and keywords with which the command calls `target`; it ends there."""

    def stop(*arguments: Any, **options: Any) -> None:
        raise Reached(arguments, options)

    monkeypatch.setattr(target, stop)
    with pytest.raises(Reached) as reached:
        main(words)
    return reached.value.args
