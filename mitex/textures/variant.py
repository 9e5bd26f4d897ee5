"""Plugin classes for the current variant, from methods that are written once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi

B = TypeVar("B")
T = TypeVar("T", bool, int, float, str)


def for_variant(base: type[B], methods: type) -> Callable[..., B]:
    """A class with Mitsuba's `base` of the current variant, and the name and members of `methods`.

    Every variant has its own base classes, and they allow neither a second base nor another metaclass, so the
    members are copied, inherited ones too. They call the base's constructor through `init_base`, not through
    `super()`. What the class is called with are the arguments of the constructor in `methods`.
    """
    members: dict[str, Any] = {}
    for cls in reversed(methods.__mro__[:-1]):  # without `object`
        members |= {key: value for key, value in vars(cls).items() if key not in ("__dict__", "__weakref__")}
    return cast(Callable[..., B], type(methods.__name__, (base,), members))


def require_variant(plugin: str, works: bool, variants: str) -> None:
    """Refuses a variant.

    Args:
        plugin: its type.
        works: whether it works in the current variant.
        variants: those in which it does, in words.

    Raises:
        ConfigError: it does not.
    """
    if not works:
        raise ConfigError(
            f"{plugin}: it does not work in the variant '{mi.variant()}'",
            f"use {variants}: mi.set_variant('llvm_ad_rgb') before the scene is loaded",
        )


def on_llvm() -> bool:
    """Whether the current variant compiles for the processor."""
    return dr.backend_v(mi.Float) == dr.JitBackend.LLVM


def option(props: mi.Properties, name: str, default: T) -> T:
    """The value of a plugin's property as the type of its default, which it has where it is not given."""
    value: Any = props.get(name, default)
    return type(default)(value)


def init_base(base: Any, plugin: object, props: mi.Properties) -> None:
    """Calls the constructor of Mitsuba's `base`, which a plugin class of the current variant derives from."""
    base.__init__(plugin, props)
