"""What imports what inside Mitex."""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]

# Each imports only from those after it. `mitex` is the package's own file with the version.
ORDER = [
    "__main__",
    "cli",
    "demo",
    "comparison",
    "batch",
    "methods",
    "quilting",
    "evaluation",
    "render",
    "export",
    "page",
    "asset",
    "training",
    "bridge",
    "scenes",
    "plugins",
    "integrators",
    "textures",
    "features",
    "losses",
    "atlas",
    "texels",
    "flat_charts",
    "charts",
    "mesh",
    "triples",
    "exemplar",
    "geometry",
    "images",
    "colour",
    "runtime",
    "cuts",
    "mip_map",
    "sparse",
    "cache",
    "cache_entries",
    "manifest",
    "progress",
    "records",
    "paths",
    "reading",
    "ranges",
    "suffixes",
    "suggestions",
    "optional",
    "errors",
    "mitex",
    "lazy",
]

# Importing function -> module: the lazy imports without which there would be circles, see CONTRIBUTING.
LAZY = {
    "mitex.asset.Asset.export": "mitex.export",
    "mitex.asset.Asset.load": "mitex.export",
    "mitex.asset.Asset.render": "mitex.render",
    "mitex.mesh.mesh.Mesh.load": "mitex.mesh.load",
}

# Method -> those that it imports: a baseline what it is compared with and further baselines that it needs, a
# relief what synthesizes its maps.
IMPORTED = {
    "relief": {"surface"},
    "displacement": {"geometric"},
    "quilted": {"nerf"},
    "plain_field": {"nerf"},
    "nerf_tex": {"nerf"},
}
SHARED = {"baselines", "neural_style", "words"} | {
    file.stem for file in (ROOT / "mitex" / "methods").glob("*.py")
}


class Import(NamedTuple):
    """An import of one module in another, in its function or class `place`; "" is the top of the file."""

    importer: str
    place: str
    target: str

    @property
    def site(self) -> str:
        return f"{self.importer}.{self.place}" if self.place else self.importer


def modules(root: Path) -> dict[str, ast.Module]:
    """The modules of the package `mitex` below a folder: dotted name -> syntax tree."""
    trees = {}
    for file in sorted((root / "mitex").rglob("*.py")):
        parts = file.relative_to(root).with_suffix("").parts
        trees[".".join(parts).removesuffix(".__init__")] = ast.parse(file.read_text(), str(file))
    return trees


def imports(trees: dict[str, ast.Module]) -> set[Import]:
    """Every import between modules of `mitex` that is run: not those under `if TYPE_CHECKING`.

    Names that are looked up from strings on first use (`mitex.lazy`) are no imports. Neither is that of the
    package which importing one of its modules brings along.
    """
    return {
        Import(module, place, name if name in trees else name.rpartition(".")[0])
        for module, tree in trees.items()
        for place, name in _imported(tree, "")
        if name.partition(".")[0] == "mitex"
    }


def _imported(node: ast.AST, place: str) -> Iterator[tuple[str, str]]:
    """Place and dotted name of all that is imported below a node."""
    match node:
        case ast.Import(names=aliases):
            yield from ((place, alias.name) for alias in aliases)
        case ast.ImportFrom(level=level) if level:
            raise AssertionError(f"line {node.lineno}: a relative import")
        case ast.ImportFrom(module=str(module), names=aliases):
            yield from ((place, f"{module}.{alias.name}") for alias in aliases)
        case ast.If(test=ast.Name("TYPE_CHECKING"), orelse=branch):
            for child in branch:
                yield from _imported(child, place)
        case _:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                place = f"{place}.{node.name}".lstrip(".")
            for child in ast.iter_child_nodes(node):
                yield from _imported(child, place)


def circle(links: Iterable[Import]) -> list[str]:
    """Modules that import each other in a circle, the first one again at the end; empty if none do."""
    sorter = TopologicalSorter()
    for link in links:
        sorter.add(link.importer, link.target)
    try:
        sorter.prepare()
    except CycleError as e:
        return e.args[1]
    return []


def part(module: str) -> str:
    """The entry of `ORDER` that a module belongs to."""
    return module.split(".")[1] if "." in module else module


def method(module: str) -> str:
    """The method or baseline that a module belongs to; "" outside of them, and for what methods share."""
    if not module.startswith("mitex.methods."):
        return ""
    name = module.removeprefix("mitex.methods.").removeprefix("baselines.").partition(".")[0]
    return "" if name in SHARED else name


@cache
def package() -> dict[str, ast.Module]:
    return modules(ROOT)


@cache
def links() -> list[Import]:
    return sorted(imports(package()))


def is_lazy(link: Import) -> bool:
    return LAZY.get(link.site) == link.target


def test_no_circles_but_the_lazy_ones():
    assert circle(link for link in links() if not is_lazy(link)) == []


@pytest.mark.parametrize("site", LAZY)
def test_each_lazy_import_is_there_and_needed(site):
    rest = [link for link in links() if link.site == site or not is_lazy(link)]
    assert any(is_lazy(link) for link in rest)
    assert circle(rest)


def test_only_the_command_line_the_demo_and_batches_import_methods():
    users = {part(link.importer) for link in links() if part(link.target) == "methods"}
    assert users == {"batch", "cli", "comparison", "demo", "methods"}


def test_methods_do_not_import_each_other():
    pairs = {
        (method(link.importer), method(link.target)): link
        for link in links()
        if method(link.importer) and method(link.target)
    }
    allowed = {(name, other) for name, others in IMPORTED.items() for other in others}
    assert {pair: link for pair, link in pairs.items() if pair[0] != pair[1] and pair not in allowed} == {}
    assert allowed <= pairs.keys()


def test_imports_follow_the_order():
    place = {name: i for i, name in enumerate(ORDER)}
    assert place.keys() == {part(module) for module in package()}
    upwards = [link for link in links() if place[part(link.target)] < place[part(link.importer)]]
    assert [link for link in upwards if not is_lazy(link)] == []


def imports_in(folder: Path, **files: str) -> set[Import]:
    (folder / "mitex").mkdir()
    for name, text in files.items():
        (folder / "mitex" / f"{name}.py").write_text(text)
    return imports(modules(folder))


def test_imports_are_read_from_the_source(tmp_path):
    text = """
        import numpy
        from mitex import __version__, b
        from mitex.b import name
        if TYPE_CHECKING:
            from mitex.d import Type
        else:
            from mitex.c import Type
        class A:
            def load(self):
                import mitex.d
        """
    assert imports_in(tmp_path, __init__="", a=dedent(text), b="", c="", d="") == {
        Import("mitex.a", "", "mitex"),
        Import("mitex.a", "", "mitex.b"),
        Import("mitex.a", "", "mitex.c"),
        Import("mitex.a", "A.load", "mitex.d"),
    }


def test_a_circle_through_functions_is_seen(tmp_path):
    late = "def f():\n    from mitex.{} import g\n"
    links = imports_in(
        tmp_path, a="import mitex.b", b=late.format("c"), c=late.format("a"), d="import mitex.a"
    )
    assert set(circle(links)) == {"mitex.a", "mitex.b", "mitex.c"}
    assert circle(link for link in links if link.site != "mitex.c.f") == []


def test_the_method_of_a_module():
    assert method("mitex.methods.nca") == method("mitex.methods.nca.task") == "nca"
    assert method("mitex.methods.baselines.quilted") == "quilted"
    assert method("mitex.methods.baselines.displacement.cli") == "displacement"
    assert method("mitex.methods.registry") == method("mitex.methods.baselines") == ""
    assert method("mitex") == method("mitex.methods") == method("mitex.mesh.mesh") == ""
