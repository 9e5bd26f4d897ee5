"""Public names that Mitex imports on first use, imported before autodoc asks which names there are."""

from __future__ import annotations

from importlib import import_module

from sphinx.application import Sphinx

LAZY = ["mitex", "mitex.training"]


def resolve(app: Sphinx) -> None:
    """Resolves `__all__` of the packages whose names are lazy."""
    from mitex.methods.registry import methods

    homes = [method.texture.partition(":")[0].rpartition(".")[0] for method in methods().values()]
    for package in map(import_module, [*LAZY, *homes]):
        for name in getattr(package, "__all__", []):
            getattr(package, name)


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("builder-inited", resolve)
    return {"parallel_read_safe": True}
