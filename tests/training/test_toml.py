"""Configs as TOML, against Python's own reader."""

import math
import tomllib
from dataclasses import make_dataclass
from datetime import date
from decimal import Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitex.training.toml import to_toml

TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
INTEGER = st.integers(-(2**63), 2**63 - 1)
NUMBER = st.floats(allow_nan=False, allow_infinity=False)
LISTS = st.one_of(st.lists(INTEGER).map(tuple), st.lists(TEXT).map(tuple), st.lists(NUMBER).map(tuple))
VALUE = st.one_of(TEXT, INTEGER, NUMBER, st.booleans(), LISTS)


def _config(**values):
    return make_dataclass("Config", list(values))(**values)


@settings(max_examples=200, deadline=None)
@given(VALUE, st.dictionaries(TEXT, VALUE, max_size=3))
def test_reads_back_as_written(value, table):
    back = tomllib.loads(to_toml(_config(key=value), {"run": table}))
    assert _same(back["key"], value)
    assert back["run"].keys() == table.keys()
    assert all(_same(back["run"][name], table[name]) for name in table)


def _same(back, value):
    if isinstance(value, tuple):
        return len(back) == len(value) and all(map(_same, back, value))
    if isinstance(value, float):  # a whole float must not come back as an int, nor -0.0 as 0.0
        return type(back) is float and back == value and math.copysign(1, back) == math.copysign(1, value)
    return type(back) is type(value) and back == value


@pytest.mark.parametrize("value", [5e-324, 1e-05, 0.1, 1 / 3, -0.0, 1e22, 1.7976931348623157e308])
def test_floats_read_back_to_the_same_bits(value):
    back = tomllib.loads(to_toml(_config(key=value, keys=(value, value))))
    assert [number.hex() for number in (back["key"], *back["keys"])] == [value.hex()] * 3


def test_none_is_a_word_and_tables_stand_below():
    text = to_toml(_config(init=None, layers=("a", None)), {"run": {"a b": "x\ny"}, "versions": {"c": None}})
    assert list(tomllib.loads(text).items()) == [
        ("init", "none"),
        ("layers", ["a", "none"]),
        ("run", {"a b": "x\ny"}),
        ("versions", {"c": "none"}),
    ]


@pytest.mark.parametrize(
    ("value", "error"),
    [
        (math.nan, ValueError),
        (-math.inf, ValueError),
        ((1.0, math.inf), ValueError),
        ({}, TypeError),
        (date(2000, 1, 1), TypeError),
        (Decimal(1), TypeError),
        ((b"",), TypeError),
    ],
)
def test_refuses_what_a_config_cannot_hold(value, error):
    with pytest.raises(error):
        to_toml(_config(key=value))
    with pytest.raises(error):
        to_toml(_config(), {"run": {"key": value}})
