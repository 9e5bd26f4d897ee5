"""Checks of option values."""

import math
from pathlib import Path

import pytest

from mitex.errors import ConfigError
from mitex.methods.checks import in_range, merged_settings, mutually_exclusive, reject_unused


@pytest.mark.parametrize("value", [None, 1, 2.5, 10])
def test_in_range_passes(value):
    assert in_range("--x", value, 1, 10) is None


@pytest.mark.parametrize("value", [0.999, 10.1, -1, math.nan, math.inf, -math.inf])
def test_in_range_refuses(value):
    with pytest.raises(ConfigError, match="--x .* out of range; choose a value from 1 to 10"):
        in_range("--x", value, 1, 10)


def test_open_range():
    in_range("--x", 10**9, 1)
    for value in (0, math.inf):
        with pytest.raises(ConfigError, match="of at least 1"):
            in_range("--x", value, 1)


def test_contradictions():
    mutually_exclusive("--a", "--b", False)
    reject_unused("--a", Path("x.png"), False)
    with pytest.raises(ConfigError, match="--a and --b contradict"):
        mutually_exclusive("--a", "--b", True)
    with pytest.raises(ConfigError, match="--a means nothing for .png files"):
        reject_unused("--a", Path("x.png"), True)


def test_settings_come_together():
    assert merged_settings([["a=1", "b=2"], ["c = 3"]], seed=4, steps=None) == [
        "a=1",
        "b=2",
        "c = 3",
        "seed=4",
    ]
    assert merged_settings([["seed=4"]], seed=4) == ["seed=4", "seed=4"]


@pytest.mark.parametrize("words", [["a=1", "a=2"], ["seed=5"]])
def test_settings_refuse_two_values(words):
    with pytest.raises(ConfigError, match="give it once"):
        merged_settings([words], seed=4)


@pytest.mark.parametrize(
    ("value", "high", "message"),
    [
        (0.1 + 0.2, 0.25, "--x 0.3 is out of range; choose a value from 0 to 0.25"),
        (5_000_000_000, 2**32 - 1, "--x 5000000000 is out of range; choose a value from 0 to 4294967295"),
        (-1, math.inf, "--x -1 is out of range; choose a value of at least 0"),
    ],
)
def test_numbers_are_shown_as_people_write_them(value, high, message):
    with pytest.raises(ConfigError) as error:
        in_range("--x", value, 0, high)
    assert str(error.value) == message
