"""The methods of texture synthesis, one package each; `registry.methods()` lists them.

Each package has a `METHOD`, a `fit`, and a texture whose `apply` puts it on a mesh.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import Any


def __getattr__(name: str) -> Any:
    if name.startswith("_") or find_spec(f"{__name__}.{name}") is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name}")
