"""Packages that Mitex needs for some things only: the extras of its installation."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from mitex.errors import MissingPackage


def optional(module: str, extra: str) -> ModuleType:
    """A module of an optional package, or one that imports such packages.

    Args:
        module: its name.
        extra: of Mitex, which installs what it needs.

    Raises:
        MissingPackage: it cannot be imported.
    """
    try:
        return import_module(module)
    except ImportError as e:
        raise MissingPackage(
            f"an optional package is missing ({e})", f"run `pip install 'mitex[{extra}]'`"
        ) from e
