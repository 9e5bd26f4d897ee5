"""The reference of the plugins, which is their docstrings, against what they read and expose."""

import inspect
import re
from typing import Any

import pytest

from mitex.plugins import init
from mitex.runtime.jit import mi
from mitex.textures import ShellField
from mitex.textures.variant import for_variant
from tests.docs.plugins import PLUGINS, fog

init()

TYPES = {bool: "|bool|", int: "|int|", float: "|float|", str: "|string|"}
REQUIRED = object()


class Reader(mi.Properties):
    """Properties that note what is read of them, with its default."""

    def __init__(self, plugin: str) -> None:
        super().__init__(plugin)
        self.defaults: dict[str, Any] = {}
        for name, value in PLUGINS[plugin].properties().items():
            self[name] = value

    def __getitem__(self, key: str) -> Any:
        self.defaults.setdefault(key, REQUIRED)
        return super().__getitem__(key)

    def __contains__(self, key: object) -> bool:
        self.defaults.setdefault(str(key), None)
        return super().__contains__(key)  # pyright: ignore[reportArgumentType]

    def get(self, key: str, default: Any = None) -> Any:
        self.defaults[key] = default
        return super().get(key, default)


class Exposed(mi.TraversalCallback):
    """The names of a plugin's parameters, and whether they are differentiable."""

    def __init__(self, plugin: Any) -> None:
        super().__init__()
        self.names: dict[str, bool] = {}
        plugin.traverse(self)

    def put(self, name: str, value: Any, flags: Any) -> None:
        self.names[name] = not int(flags) & int(mi.ParamFlags.NonDifferentiable)


@pytest.fixture
def reference(site_module):
    """The list of parameters of a class: for each name its type, description and flags."""
    parameters = site_module("plugin_reference").parameters

    def read(cls):
        lines = (inspect.getdoc(cls) or "").splitlines()
        items = "\n".join(line for line in lines if re.match(r" (\*|  )", line))
        return {name: cells for name, *cells in parameters(items)}

    return read


@pytest.fixture
def build():
    """A plugin and the properties that it has read."""

    def plugin(name):
        reader, entry = Reader(name), PLUGINS[name]
        return for_variant(getattr(mi, entry.base), entry.cls)(reader), reader

    return plugin


def numbered(names: dict[str, Any]) -> dict[str, Any]:
    """With k in place of the numbers of layers."""
    return {re.sub(r"_\d+$", "_k", name): value for name, value in names.items()}


def described(description: str) -> str | None:
    """The default in a description."""
    match = re.search(r"\(Default: (.+)\)$", description)
    return match and match[1]


@pytest.mark.parametrize("plugin", PLUGINS)
def test_it_lists_what_a_plugin_reads_with_types_and_defaults(reference, build, plugin):
    listed, defaults = reference(PLUGINS[plugin].cls), numbered(build(plugin)[1].defaults)
    assert set(listed) == set(defaults)
    for name, default in defaults.items():
        kind, description, _ = listed[name]
        if type(default) in TYPES:
            word = f"{default:g}" if isinstance(default, float) else str(default).lower() or "none"
            assert (kind.split()[0], described(description)) == (TYPES[type(default)], word), name
        elif default is REQUIRED:
            assert described(description) is None, name


@pytest.mark.parametrize("plugin", PLUGINS)
def test_its_flags_are_those_of_the_parameters(reference, build, plugin):
    listed = reference(PLUGINS[plugin].cls)
    flags = {name: cells[-1] for name, cells in listed.items() if cells[-1]}
    words = {True: "exposed, differentiable", False: "exposed"}
    names = Exposed(build(plugin)[0]).names
    assert flags == {name: words[able] for name, able in numbered(names).items()}


def test_that_of_a_shell_field_lists_its_arguments(reference):
    listed, parameters = reference(ShellField), inspect.signature(ShellField).parameters
    assert list(listed) == list(parameters)
    optional = {name for name, p in parameters.items() if p.default is not p.empty}
    assert {name for name, cells in listed.items() if described(cells[1])} == optional
    assert listed["field"][-1] == "exposed, differentiable" and Exposed(fog()).names == {"density": True}
