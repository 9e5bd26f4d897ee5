"""The declared dependencies are exactly those imported."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterable
from importlib.metadata import files
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CORE = PROJECT["dependencies"]
EXTRAS = PROJECT["optional-dependencies"]
OWN = {"mitex", "tests", "tools", "benchmarks", "scenes"}
OPTIONAL = [name for name in EXTRAS if name not in ("test", "docs", "dev")]  # what parts of Mitex need

# Distribution -> the module that it installs, where the names differ.
MODULES = {
    "imageio-ffmpeg": "imageio_ffmpeg",
    "markdown-it-py": "markdown_it",
    "opencv-python-headless": "cv2",
    "pillow": "PIL",
    "scikit-image": "skimage",
    "tomli-w": "tomli_w",
}
# Distribution -> why it is needed though nothing imports it.
WITHOUT_IMPORT = {
    "karellen-llvm-core": "Dr.Jit opens its shared library",
    "pytest-xdist": "`make test` runs two tests at a time",
    "build": "test_packaging.py runs `python -m build`",
    "hatchling": "the build backend of that test's wheel",
    "myst-nb": "Sphinx reads Markdown and executes notebooks with it",
    "furo": "the theme of the site",
    "sphinx-copybutton": "the site's code has a button to copy it",
    "ruff": "`make lint`",
    "pyright": "`make lint`",
}


def distributions(requirements: Iterable[str]) -> set[str]:
    """The names in requirements (PEP 508), without Mitex's own."""
    return {re.split(r"[^\w.-]", requirement, maxsplit=1)[0] for requirement in requirements} - {"mitex"}


def modules(requirements: Iterable[str]) -> set[str]:
    """What requirements must be imported as."""
    return {MODULES.get(name, name) for name in distributions(requirements) - WITHOUT_IMPORT.keys()}


def imports(*folders: Path) -> set[str]:
    """Top-level modules imported below folders, in functions too, also by `import_module` and `optional`.

    The standard library, Mitex, and the files and packages of the folders do not count.
    """
    scripts = [file for folder in folders for file in folder.rglob("*.py")]
    packages = {file.parent.name for file in scripts}
    names = {name.partition(".")[0] for file in scripts for name in _imported(ast.parse(file.read_text()))}
    return names - OWN - packages - {file.stem for file in scripts} - sys.stdlib_module_names


def _imported(tree: ast.AST) -> Iterable[str]:
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=aliases):
                yield from (alias.name for alias in aliases)
            case ast.ImportFrom(module=str(module), level=0):
                yield module
            case ast.Call(func=ast.Name("import_module" | "optional"), args=[ast.Constant(str(module)), *_]):
                yield module


def faults(declared: set[str], imported: set[str]) -> list[str]:
    """How the declared modules differ from the imported ones; empty if they do not."""
    return [f"{name} is declared, but not imported" for name in sorted(declared - imported)] + [
        f"{name} is imported, but not declared" for name in sorted(imported - declared)
    ]


def test_of_the_package():
    optional = modules(requirement for name in OPTIONAL for requirement in EXTRAS[name])
    assert faults(modules(CORE) | optional, imports(ROOT / "mitex")) == []
    assert modules(CORE) & optional == set()


def test_of_the_tests():
    # Tests import the files of tools, and modules that they write, which are called mitex_....
    packages = {name for name in imports(ROOT / "tests", ROOT / "tools") if not name.startswith("mitex_")}
    assert faults(modules(EXTRAS["test"]), packages - imports(ROOT / "mitex")) == []


@pytest.mark.parametrize("folder", ["tools", "benchmarks", "scenes"])
def test_scripts_need_nothing_further(folder):
    assert faults(set(), imports(ROOT / folder) - imports(ROOT / "mitex")) == []


def test_of_the_site():
    assert faults(modules(EXTRAS["docs"]), imports(ROOT / "docs") - imports(ROOT / "mitex")) == []


def test_of_development():
    assert modules(EXTRAS["dev"]) == set()
    everything = [*CORE, *EXTRAS["test"], *EXTRAS["docs"], *EXTRAS["dev"]]
    assert WITHOUT_IMPORT.keys() <= distributions(everything)


@pytest.mark.parametrize(("distribution", "module"), MODULES.items())
def test_a_module_is_that_of_its_distribution(distribution, module):
    assert any(file.parts[0] == module for file in files(distribution) or [])


def test_an_unused_and_an_undeclared_dependency_are_named(tmp_path):
    (tmp_path / "local.py").write_text("import json, numpy.linalg\nfrom PIL.Image import open\n")
    (tmp_path / "module.py").write_text(
        "import local\n"
        "from . import local\n"
        "def late():\n"
        "    from torch.nn import functional\n"
        "    import_module('mitsuba.python')\n"
        "    optional('coacd', 'nerf')\n"
    )
    imported = imports(tmp_path)
    assert imported == {"numpy", "PIL", "torch", "mitsuba", "coacd"}
    declared = modules(
        ["numpy>=2", "pillow", "scipy[all]>=1; python_version>'3'", "torch", "ruff", "mitex[nerf]"]
    )
    assert declared == {"numpy", "PIL", "scipy", "torch"}
    assert faults(declared, imported) == [
        "scipy is declared, but not imported",
        "coacd is imported, but not declared",
        "mitsuba is imported, but not declared",
    ]
    assert faults({"numpy"}, {"numpy"}) == []
