"""The border of a loader."""

import json
import os

import pytest

from mitex.errors import ConfigError, MeshError, MitexError
from mitex.reading import content, reading


def boundary(**options):
    return reading("a.toy", MeshError, "export it again", **options)


@pytest.mark.parametrize(
    "fault",
    [
        lambda: json.loads("{"),
        lambda: json.loads("[" * 100_000),
        lambda: {}["key"],
        lambda: [].items(),  # type: ignore[attr-defined]
        lambda: int(float("inf")),
        lambda: os.stat("/no/such/file"),
        lambda: bytearray(2**60),
    ],
)
def test_what_a_file_can_cause_names_the_file(fault):
    with pytest.raises(MeshError, match="'a.toy' cannot be read") as error, boundary():
        fault()
    assert "\n" not in str(error.value) and error.value.__cause__ is not None


def test_bugs_stay_bugs():
    class Ours:
        pass

    for bug in (lambda: unknown, lambda: Ours().missing):  # type: ignore[attr-defined,name-defined] # noqa: F821
        with pytest.raises((NameError, AttributeError)), boundary():
            bug()
    with pytest.raises(AssertionError), boundary():
        raise AssertionError


def test_our_own_errors_pass_but_those_that_mean_damage():
    with pytest.raises(ConfigError), boundary():
        raise ConfigError("a", "b")
    with pytest.raises(MeshError, match="a.toy"), boundary(also=(ConfigError,)):
        raise ConfigError("a", "b")
    with pytest.raises(MitexError, match="^said before; so$"), boundary(also=(MitexError,)):
        raise MeshError("said before", "so")


def test_content_has_a_limit_and_is_of_regular_files(tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    assert content(tmp_path / "a", 5) == b"12345"
    os.mkfifo(tmp_path / "pipe")
    for place, words in (
        (tmp_path / "a", "more than 4"),
        ("/dev/zero", "regular"),
        (tmp_path / "pipe", "regular"),
    ):
        with pytest.raises(ValueError, match=words):
            content(place, 4)
