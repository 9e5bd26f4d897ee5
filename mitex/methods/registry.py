"""Which methods there are, and which one a model is of."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

from mitex.errors import CheckpointError
from mitex.methods.interface import Texture
from mitex.methods.method import Method
from mitex.training.locate import bundled_files, header, locate

GROUP = "mitex.methods"  # of entry points: others' methods
PACKAGES = ("mitex.methods", "mitex.methods.baselines")


@cache
def methods() -> dict[str, Method]:
    """All methods by name: those of this package and those that others installed, baselines last.

    An installed method cannot take the name of a built-in one.
    """
    every = [*_installed(), *_built_in()]
    return {method.name: method for method in sorted(every, key=lambda m: (m.baseline, m.name))}


def method_of(source: str | Path) -> Method:
    """The method of a model file, a run folder, or a bundled model by its name.

    Raises:
        CheckpointError: there is no such model, or no method recognises it.
    """
    for file in locate(source):
        content = header(file)
        for method in methods().values():
            if content is not None and method.recognises(*content):
                return method
    raise CheckpointError(
        f"'{source}' is not a model of any method", f"give the run folder of a fit ({', '.join(methods())})"
    )


def load(source: str | Path) -> Texture:
    """The texture of a model file, a run folder, or a bundled model by its name, of whichever method.

    Raises:
        CheckpointError: there is none, or it is damaged.
    """
    return method_of(source).load_texture().load(source)


def bundled(method: Method) -> dict[str, Path]:
    """The models of a method that ship with Mitex: name -> file."""
    headers = {name: (path, header(path)) for name, path in bundled_files().items()}
    return {name: path for name, (path, head) in headers.items() if head and method.recognises(*head)}


def _built_in() -> Iterator[Method]:
    for package in map(import_module, PACKAGES):
        for module in pkgutil.iter_modules(package.__path__):
            if module.ispkg:
                folder = import_module(f"{package.__name__}.{module.name}")
                if isinstance(method := getattr(folder, "METHOD", None), Method):
                    yield method


def _installed() -> Iterator[Method]:
    for point in entry_points(group=GROUP):
        if isinstance(method := point.load(), Method):
            yield method
