"""What a long computation is at, told to whoever listens in the same thread; by default nobody does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar, cast

Item = TypeVar("Item")
Listener = Callable[[str, int, int], None]

_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


def announce(work: str, done: int = 0, total: int = 0) -> None:
    """Says what is being done from now on.

    Args:
        work: in a few words; "" ends what was announced before, for something that shows itself.
        done: how many of its parts are done.
        total: how many parts it has; 0 if that is not known.
    """
    listener = _listener.get()
    if listener is not None:
        listener(work, done, total)


def counted(work: str, items: Iterable[Item], total: int, done: int = 0) -> Iterator[Item]:
    """The items, announced as parts of one work, of which some were done before; what computing them would
    announce is not heard.
    """
    iterator, end = iter(items), object()
    while True:
        announce(work, done, total)
        with listening(None):
            item = next(iterator, end)
        if item is end:
            return
        yield cast(Item, item)
        done += 1


@contextmanager
def listening(listener: Listener | None) -> Iterator[None]:
    """Within the context `listener` hears of all work announced in this thread; nobody does if None."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
