"""The shape of errors that users see."""

import pickle

import pytest

from mitex import errors


@pytest.mark.parametrize(
    "kind",
    [
        errors.MeshError,
        errors.ImageError,
        errors.CaptureError,
        errors.ConfigError,
        errors.OutputError,
        errors.CheckpointError,
        errors.RuntimeUnavailable,
    ],
)
def test_problem_and_remedy_make_one_line(kind: type[errors.MitexError]):
    error = kind("'a.obj' is empty", "name another file")
    assert isinstance(error, errors.MitexError)
    assert str(error) == "'a.obj' is empty; name another file"
    assert (error.problem, error.remedy) == ("'a.obj' is empty", "name another file")


def test_errors_survive_worker_processes():
    error = pickle.loads(pickle.dumps(errors.MeshError("a", "b")))
    assert type(error) is errors.MeshError and str(error) == "a; b"
