"""How long the files and functions of Mitex are."""

import ast
import statistics
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "mitex"

Function = ast.FunctionDef | ast.AsyncFunctionDef


def functions(text: str) -> list[Function]:
    return [node for node in ast.walk(ast.parse(text)) if isinstance(node, Function)]


def lines(function: Function) -> int:
    """Length of a function without its docstring."""
    first = function.body[0]
    text = (first.end_lineno or 0) - first.lineno + 1 if ast.get_docstring(function) is not None else 0
    return (function.end_lineno or 0) - function.lineno + 1 - text


def test_files_are_short():
    lengths = {str(file): len(file.read_text().splitlines()) for file in PACKAGE.rglob("*.py")}
    assert statistics.median(lengths.values()) <= 110
    assert {file: length for file, length in lengths.items() if length > 350} == {}


def test_functions_are_short():
    every = [(file, node) for file in PACKAGE.rglob("*.py") for node in functions(file.read_text())]
    assert [(str(file), node.name) for file, node in every if lines(node) > 60] == []


def test_lines_leave_out_the_docstring():
    (function,) = functions('def f():\n    """A.\n\n    B.\n    """\n    return 1\n')
    assert lines(function) == 2
