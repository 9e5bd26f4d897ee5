"""Values of config keys: reading them from text or TOML by the key's annotated type.

Types: int, float, bool, str, None, Literal, tuples of these (any or fixed length), and unions of these.
"""

import math
import types
from collections.abc import Callable, Sequence
from typing import Any, Literal, Union, get_args, get_origin

from mitex.errors import ConfigError

Reader = Callable[[Any, Any], Any]  # from a value and its type to the value that it stands for

TRUTH = {
    "true": True,
    "yes": True,
    "on": True,
    "1": True,
    "false": False,
    "no": False,
    "off": False,
    "0": False,
}
NAMES = {int: "a whole number", float: "a finite number", bool: "true or false", str: "a text"}


def parse(text: str, kind: Any) -> Any:
    """Reads a value from what a person typed: `8`, `1e-3`, `yes`, `none`, `relu1_1,relu2_1`, `[1, 2]`.

    Raises:
        ValueError: The text is no value of this type.
    """
    if kind is str:
        return text
    if kind is bool:
        return _one_of(TRUTH, text.lower())
    if kind is int:
        return int(text)
    if kind is float:
        return _finite(float(text))
    if kind is types.NoneType:
        return _one_of({"none": None}, text.lower())
    if get_origin(kind) is Literal:
        return _one_of({str(choice): choice for choice in get_args(kind)}, text)
    if get_origin(kind) is tuple:
        inner = text[1:-1] if text[:1] + text[-1:] in ("[]", "()") else text
        items = [item.strip().strip("'\"") for item in inner.split(",")]
        if not items[-1]:  # an empty list, or a comma at the end
            items.pop()
        return _each(parse, items, kind)
    return _first(parse, text, kind)


def check(value: Any, kind: Any) -> Any:
    """Reads a value that has a type already, as from TOML; lists become tuples.

    "none" stands for None, which TOML does not have, where that is allowed.

    Raises:
        ValueError: It is no value of this type.
    """
    if kind is types.NoneType:
        return None if value is None else _one_of({"none": None}, value)
    if kind is float and type(value) in (int, float):
        return _finite(value)
    if kind in NAMES and type(value) is kind:  # an exact match, since True would pass as an int
        return value
    if get_origin(kind) is Literal:
        for choice in get_args(kind):
            if type(choice) is type(value) and choice == value:
                return choice
        raise ValueError(value)
    if get_origin(kind) is tuple and isinstance(value, list | tuple):
        return _each(check, value, kind)
    return _first(check, value, kind)


def read(reader: Reader, value: Any, kind: Any, name: str) -> Any:
    """Reads a value that somebody has given.

    Args:
        reader: `parse` or `check`.
        value, kind: its arguments.
        name: whose value it is, for the message.

    Raises:
        ConfigError: It is no value of this type.
    """
    try:
        return reader(value, kind)
    except ValueError as e:
        raise ConfigError(f"{name} cannot be {value!r}", f"give {describe(kind)}") from e


def describe(kind: Any) -> str:
    """Names what is wanted: "a whole number", "a list of texts", ..."""
    if kind in NAMES:
        return NAMES[kind]
    if kind is types.NoneType:
        return "'none'"
    arguments = get_args(kind)
    if get_origin(kind) is Literal:
        return "one of " + ", ".join(repr(choice) for choice in arguments)
    if get_origin(kind) is tuple:
        if arguments[-1] is ...:
            return f"a list, each item {describe(arguments[0])}"
        return f"a list of {len(arguments)}: " + ", ".join(describe(item) for item in arguments)
    return " or ".join(describe(member) for member in arguments)


def number_text(number: float) -> str:
    """A number to be read: whole ones as they are, others with six digits at most."""
    return str(number) if isinstance(number, int) else f"{number:.6g}"


def _one_of(choices: dict[str, Any], text: Any) -> Any:
    if not isinstance(text, str) or text not in choices:
        raise ValueError(text)
    return choices[text]


def _finite(number: float) -> float:
    try:
        if math.isfinite(number):
            return float(number)
    except OverflowError:  # an integer beyond all floats
        pass
    raise ValueError(number)


def _each(reader: Reader, items: Sequence[Any], kind: Any) -> tuple[Any, ...]:
    kinds = get_args(kind)
    if kinds[-1] is ...:
        kinds = (kinds[0],) * len(items)
    if len(items) != len(kinds):
        raise ValueError(items)
    return tuple(reader(item, item_kind) for item, item_kind in zip(items, kinds, strict=True))


def _first(reader: Reader, value: Any, kind: Any) -> Any:
    """Reads as the first member of a union that fits; None before text, so that `none` is not a text."""
    members = get_args(kind) if get_origin(kind) in (Union, types.UnionType) else ()
    for member in sorted(members, key=lambda member: (member is not types.NoneType, member is str)):
        try:
            return reader(value, member)
        except ValueError:
            continue
    raise ValueError(value)
