"""The systems: each package offers `fit` and a texture with `apply`."""

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    if name == "nca":
        return import_module("mitex.methods.nca")
    raise AttributeError(f"mitex.methods has no {name!r}")
