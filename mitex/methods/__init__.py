"""The systems: each package offers `fit` and a texture with `apply`."""

from importlib import import_module
from typing import Any

NAMES = ("nca", "surface", "geometric", "nerf")


def __getattr__(name: str) -> Any:
    if name in NAMES:
        return import_module(f"mitex.methods.{name}")
    raise AttributeError(f"mitex.methods has no {name!r}")
