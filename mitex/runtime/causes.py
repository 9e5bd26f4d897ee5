"""Errors inside Dr.Jit's custom operations and loops."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

WRAPPER = "(see above)"  # in the messages of Dr.Jit's own errors that only say that there was another


@contextmanager
def raise_causes() -> Iterator[None]:
    """Raises what went wrong inside a custom operation or loop of Dr.Jit as it is.

    Dr.Jit raises a RuntimeError "drjit.custom(...): error while performing a custom differentiable operation.
    (see above)" instead, of which it is the cause: `mi.render` is such an operation, too::

        with raise_causes():
            image = mi.render(scene)
    """
    try:
        yield
    except RuntimeError as e:
        error: BaseException = e
        while WRAPPER in str(error) and error.__cause__ is not None:
            error = error.__cause__
        if error is e:
            raise
        raise error from None
