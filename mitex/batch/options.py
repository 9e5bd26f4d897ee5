"""Options of a method's commands, from a plan's tables to the words of a command line."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any, Union

from mitex.batch.inputs import Input
from mitex.errors import ConfigError, WeightsError
from mitex.methods.method import Method
from mitex.methods.option_types import is_plain_text, known_names, may_be_file
from mitex.suggestions import suggestion
from mitex.training import values
from mitex.training.config import resolve

PLANNED = {"out", "mesh", "model", "quiet", "resume", "set", "settings"}  # what a plan says otherwise


def check_options(
    method: Method, fit: Mapping[str, Any], apply: Mapping[str, Any], label: str, folder: Path
) -> None:
    """Checks the options that a plan gives to a method, without running anything.

    Raises:
        ConfigError: An unknown name, or a value of the wrong type or out of range.
    """
    options, keys = fit_kinds(method), _keys(method)
    for name, value in fit.items():
        if name not in (*options, *keys):
            raise ConfigError(f"methods.{label} has no key '{name}'", suggestion(name, [*options, *keys]))
        if name in options:
            values.read(values.check, value, options[name], f"{name} of methods.{label}")
    for name, value in apply.items():
        kinds = apply_kinds(method)
        if name not in kinds:
            raise ConfigError(f"methods.{label}.apply has no key '{name}'", suggestion(name, kinds))
        values.read(values.check, value, kinds[name], f"{name} of methods.{label}.apply")
    _config(method, fit, folder)


def check_source(method: Method, source: str | None, fit: Mapping[str, Any], label: str) -> None:
    """Checks the option that a plan gives its exemplars to, if it is not the method's usual one.

    Raises:
        ConfigError: The method's fit has no such option, it takes no text, or `fit` gives it another one.
    """
    texts = [name for name, kind in fit_kinds(method).items() if str in _members(kind)]
    if source is not None and source not in (*texts, method.learns_from):
        raise ConfigError(f"source of methods.{label} cannot be '{source}'", suggestion(source, texts))
    if source in fit:
        raise ConfigError(f"methods.{label} has '{source}' besides its exemplars", f"leave out `{source}`")


def is_text(method: Method, source: str) -> bool:
    """Whether an option of the method's fit takes words or a name, and never a file."""
    return is_plain_text(_hints(method.load_fit())[source])


def source_names(method: Method) -> list[str] | None:
    """What the method may learn from besides files, by name; None if that is not known."""
    return known_names(_hints(method.load_fit())[method.learns_from])


def fit_kinds(method: Method) -> dict[str, Any]:
    """The options of the method's fit that a plan may give: name -> type."""
    return _kinds(method.load_fit(), {method.learns_from, "seed"})


def apply_kinds(method: Method) -> dict[str, Any]:
    """The options of the method's `mitex apply` that a plan may give: name -> type."""
    return _kinds(method.load_apply(), set())


def implicit_inputs(method: Method, fit: Mapping[str, Any], folder: Path, *, from_text: bool) -> list[Input]:
    """Files that a fit reads although no option names them: the CLIP model of words, and VGG-19.

    Args:
        method: which is fit.
        fit: its options and settings.
        folder: of the plan.
        from_text: whether it learns from words.

    Returns:
        Those that are here; what another machine must have is missed by the job itself.
    """
    paths: list[Path | None] = []
    with suppress(WeightsError):  # both networks import torch, which takes a second
        if from_text and "clip" in fit_kinds(method) and "clip" not in fit:
            from mitex.features.text_model import model_folder

            paths.append(model_folder())
    with suppress(WeightsError):
        config = _config(method, fit, folder)
        if "vgg19" in (getattr(config, "network", None), getattr(config, "weights", None)):
            from mitex.features.vgg19 import vgg19_path

            paths.append(vgg19_path())
    return [Input(str(path), path) for path in paths if path is not None]


def fit_words(method: Method, fit: Mapping[str, Any], folder: Path) -> list[Input]:
    """The words of the options and settings of a fit; those that name files are absolute paths."""
    options = fit_kinds(method)
    words = _words({name: fit[name] for name in fit if name in options}, method.load_fit(), folder)
    settings = [f"{name}={_text(value)}" for name, value in fit.items() if name not in options]
    return [*words, *(Input(word, None) for word in (["--set", *settings] if settings else []))]


def apply_words(method: Method, apply: Mapping[str, Any], folder: Path) -> list[Input]:
    """The words of the options of `mitex apply`; those that name files are absolute paths."""
    return list(_words(apply, method.load_apply(), folder))


def _config(method: Method, fit: Mapping[str, Any], folder: Path) -> Any:
    """The settings of a fit."""
    settings = {name: value for name, value in fit.items() if name in _keys(method)}
    file = None if "config" not in fit else Path(Input.of(fit["config"], folder).text)
    return resolve(method.load_presets(), fit.get("preset"), file, settings)


def _words(options: Mapping[str, Any], command: type, folder: Path) -> Iterator[Input]:
    """The words of a command's options, by name; files are told from other texts by the options' types."""
    hints = _hints(command)
    for name, value in options.items():
        option = f"--{name.replace('_', '-')}"
        if value is True:
            yield Input(option, None)
        elif value is not False:
            # A value that begins with a dash is one word with its option.
            if isinstance(value, str) and not value.startswith("-"):
                yield Input(option, None)
                yield Input.of(value, folder) if may_be_file(value, hints[name]) else Input(value, None)
            else:
                yield Input(f"{option}={_text(value)}", None)


def _text(value: Any) -> str:
    """A value as `--set` and the options take it, with all its digits."""
    if isinstance(value, list | tuple):
        return ",".join(map(_text, value))
    return str(value).lower() if isinstance(value, bool) else str(value)


def _hints(command: type) -> dict[str, Any]:
    """The types of a command's options, with their marks."""
    return typing.get_type_hints(command, include_extras=True)


def _kinds(command: type, planned: set[str]) -> dict[str, Any]:
    hints = typing.get_type_hints(command)
    names = [field.name for field in fields(command) if field.name not in PLANNED | planned]
    return {name: _plain(hints[name]) for name in names}


def _plain(kind: Any) -> Any:
    """The type in TOML: paths are texts, and what may be None is left out rather than none."""
    members = [member for member in _members(kind) if member is not types.NoneType]
    return Union[tuple(str if member is Path else member for member in members)]  # noqa: UP007


def _members(kind: Any) -> tuple[Any, ...]:
    """Those of a union; another type itself."""
    return typing.get_args(kind) if typing.get_origin(kind) in (Union, types.UnionType) else (kind,)


def _keys(method: Method) -> set[str]:
    """The settings of the method, but the seed and the preset, which are options."""
    config = next(iter(method.load_presets().values()))
    return {field.name for field in fields(config)} - {"seed", "preset"}
