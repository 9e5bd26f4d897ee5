"""Names of a package that are resolved on first use, so that importing it stays quick."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def attributes(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """The `__getattr__` of a package (PEP 562).

    Args:
        package: Its `__name__`.
        homes: Name -> the module that defines it; "" if the name is that of a sub-package.
    """

    def resolve(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home = homes[name]
        value = getattr(import_module(home), name) if home else import_module(f"{package}.{name}")
        setattr(sys.modules[package], name, value)
        return value

    return resolve


def load(reference: str) -> Any:
    """The attribute that the reference "module:name" names; the module is imported."""
    module, _, name = reference.partition(":")
    return getattr(import_module(module), name)
