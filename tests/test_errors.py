"""The shape of errors that users see."""

import ast
import pickle
import re
from pathlib import Path

import pytest

import mitex
from mitex import errors

PACKAGE = Path(mitex.__file__).parent
# What only the command line calls.
SPOKEN = {"cli.py", "growth_options.py", "options.py", "checks.py", "animation.py", "demo.py"}


@pytest.mark.parametrize(
    "kind",
    [
        errors.MeshError,
        errors.ImageError,
        errors.CaptureError,
        errors.ConfigError,
        errors.OutputError,
        errors.CheckpointError,
        errors.MissingPackage,
        errors.RuntimeUnavailable,
    ],
)
def test_problem_and_remedy_make_one_line(kind: type[errors.MitexError]):
    error = kind("'a.obj' is empty", "name another file")
    assert isinstance(error, errors.MitexError)
    assert str(error) == "'a.obj' is empty; name another file"
    assert (error.problem, error.remedy) == ("'a.obj' is empty", "name another file")


@pytest.mark.parametrize("error", [errors.MeshError("a", "b"), mitex.Cancelled(Path("c"), 7)])
def test_errors_survive_worker_processes(error):
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error) and str(again) == str(error) and vars(again) == vars(error)


def test_every_kind_is_at_the_top():
    def kinds(base: type) -> set[type]:
        return {base, *(kind for below in base.__subclasses__() for kind in kinds(below))}

    every = {kind for base in (mitex.MitexError, mitex.MitexWarning) for kind in kinds(base)}
    ours = {kind for kind in every if kind.__module__.startswith("mitex.") and ".cli" not in kind.__module__}
    assert {getattr(mitex, kind.__name__, None) for kind in ours} == ours
    assert issubclass(mitex.Interrupted, KeyboardInterrupt)


def test_messages_speak_to_python_callers():
    """No option of the command line is named by what Python programs call, too."""
    files = [f for f in PACKAGE.rglob("*.py") if f.name not in SPOKEN and f.parent.name != "cli"]
    raised = [(f, n) for f in files for n in ast.walk(ast.parse(f.read_text())) if isinstance(n, ast.Raise)]
    assert len(raised) > 100
    options = [(f.name, n.lineno) for f, n in raised if re.search(r"(?<!\w)--[a-z]", ast.unparse(n))]
    assert options == []
