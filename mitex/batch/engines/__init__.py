"""Where jobs run. An engine takes tasks and gives back handles; it knows nothing of plans or results."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any, Protocol

from mitex.batch.task import Outcome, Task

__all__ = ["Engine", "Handle", "WorkerLost"]


class WorkerLost(Exception):
    """The process or machine that did a task is gone; the task can be submitted again."""


class Handle(Protocol):
    """A task that was submitted."""

    def done(self) -> bool:
        """Whether `result` answers at once.

        Raises:
            MitexError: The engine itself is gone.
        """
        ...

    def result(self) -> Outcome:
        """How it ended.

        Raises:
            WorkerLost: That will never be known.
            MitexError: The task, or the engine, cannot go on.
        """
        ...

    def cancel(self) -> Any:
        """Takes a task back that has not begun."""
        ...


class Engine(AbstractContextManager["Engine"], Protocol):
    """Runs tasks, from its `__enter__` to its `__exit__`.

    Attributes:
        threads: of each job, if nobody says otherwise.
        at_once: how many tasks it is given at a time; None for all.
        pause: between two looks at its tasks [s].
    """

    threads: int
    at_once: int | None
    pause: float

    def submit(self, task: Task) -> Handle:
        """Begins a task, or puts it into the queue."""
        ...
