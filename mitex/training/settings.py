"""Settings of a fit: what every fit is told, and configs whose keys say what they mean and take."""

from __future__ import annotations

import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypedDict, get_args, get_origin

from mitex.errors import ConfigError
from mitex.ranges import SEEDS
from mitex.training import values
from mitex.training.control import Cancel, Progress


class RunSettings(TypedDict, total=False):
    """How a fit is set up.

    Attributes:
        preset: Name of the preset to start from; the first one if None.
        config: TOML file with any of the settings, or a run's config.toml.
        set: Any settings, by key; or `key=value` texts.
        seed: Of all randomness.
        steps: Training steps.
        resume: Go on from the run's checkpoint, with its config as far as no other is given.
    """

    preset: str | None
    config: str | Path | None
    set: Mapping[str, Any] | Sequence[str]
    seed: int | None
    steps: int | None
    resume: bool


class RunOptions(RunSettings, total=False):
    """What every `fit` takes besides what it learns from: `RunSettings`, and what its caller hears and says.

    Attributes:
        on_step: Called with a `Progress` at the start and after every step, in the fit's own thread.
        cancel: Stops the fit before the next step once its `is_set()` is true, as of a `threading.Event`.
    """

    on_step: Callable[[Progress], None] | None
    cancel: Cancel | None


def key(default: Any, meaning: str, low: float | None = None, high: float | None = None) -> Any:
    """A key of a config, to be used as a dataclass field's default.

    Args:
        default: Its value in the default preset.
        meaning: A phrase for `--settings`, with units in brackets.
        low, high: Inclusive bounds of a number, or of every number of a tuple; None leaves a side open.
    """
    return field(default=default, metadata={"meaning": meaning, "range": (low, high)})


@cache
def kinds(config: type) -> dict[str, Any]:
    """The types of a config's keys, by name; kept, since evaluating their texts takes a millisecond."""
    return typing.get_type_hints(config)


@dataclass(frozen=True)
class FitConfig:
    """What every method's config has; a default-constructed one is the method's default preset.

    A method's config extends it with keys of its own, and may give these other defaults, whose meaning and
    range stay. `Literal` annotations are the choices of a key.

    Raises:
        ConfigError: A value is out of its range or none of the choices.
    """

    preset: str = key("default", "the preset that the settings started from")
    seed: int = key(0, "number that all random choices follow from", *SEEDS)

    def __post_init__(self) -> None:
        types = kinds(type(self))
        for one in fields(self):
            value = getattr(self, one.name)
            _check_choice(one.name, value, types[one.name])
            _check_range(one.name, value, *bounds(type(self), one))


@dataclass(frozen=True)
class TrainingConfig(FitConfig):
    """What the configs of methods have that train step by step."""

    steps: int = key(1000, "training steps", 1)
    checkpoint_every: int = key(100, "steps between two checkpoints", 1)
    preview_every: int = key(100, "steps between two previews; 0 makes none", 0)


@dataclass(frozen=True)
class ScheduledConfig(TrainingConfig):
    """What the configs of methods have whose learning rate falls at some steps."""

    lr: float = key(1e-3, "learning rate of Adam", 0)
    milestones: tuple[int, ...] = key((), "steps at which the learning rate falls", 0)
    decay: float = key(0.1, "factor of the learning rate at a milestone", 0)

    @property
    def schedule(self) -> dict[str, Any]:
        """Options of `train` for the learning rate."""
        return {"lr": self.lr, "milestones": self.milestones, "decay": self.decay}


@dataclass(frozen=True)
class DeviceConfig(TrainingConfig):
    """What the configs of methods have that can train on a graphics card."""

    device: Literal["cpu", "cuda"] = key(
        "cpu", "where the training runs: the processor, or the first CUDA graphics card"
    )


def meaning(config: type[FitConfig], one: Field) -> str:
    """The phrase that explains a key."""
    return _metadata(config, one)["meaning"]


def bounds(config: type[FitConfig], one: Field) -> tuple[float | None, float | None]:
    """Inclusive bounds of a key's numbers."""
    return _metadata(config, one)["range"]


class Row(NamedTuple):
    """A key of a config as people read it: name, value, what it can be ("" for anything), and meaning."""

    name: str
    value: str
    allowed: str
    meaning: str


def rows(config: FitConfig) -> list[Row]:
    """Every key of a config, in the order of its declaration."""
    types = kinds(type(config))
    return [
        Row(
            one.name,
            _written(getattr(config, one.name)),
            _allowed(types[one.name], *bounds(type(config), one)),
            meaning(type(config), one),
        )
        for one in fields(config)
    ]


def table(config: FitConfig) -> str:
    """The text of `--settings`: a line for each key, with its value in this config, its range and meaning."""
    lines = [(f"{row.name} = {row.value}", row) for row in rows(config)]
    width = min(max(len(setting) for setting, _ in lines), 30)
    return "\n".join(
        f"{setting:{width}}  {row.meaning}{f' ({row.allowed})' if row.allowed else ''}"
        for setting, row in lines
    )


def _written(value: Any) -> str:
    """A value as `--set` takes it, numbers with six digits at most."""
    if isinstance(value, tuple):
        return ",".join(map(_written, value))
    if isinstance(value, float):
        return str(float(f"{value:.6g}"))
    return value if isinstance(value, str) else str(value).lower()


def _metadata(config: type, one: Field) -> Any:
    """The metadata of a key, which a class that only gives it another default inherits."""
    for base in config.__mro__:
        declared = vars(base).get("__dataclass_fields__", {}).get(one.name)
        if declared is not None and declared.metadata:
            return declared.metadata
    raise TypeError(f"{config.__name__}.{one.name} is not declared with `key`")


def _check_choice(name: str, value: Any, kind: Any) -> None:
    if get_origin(kind) is Literal and value not in get_args(kind):
        raise ConfigError(f"{name} = '{value}' is unknown", f"give {values.describe(kind)}")


def _check_range(name: str, value: Any, low: float | None, high: float | None) -> None:
    for number in value if isinstance(value, tuple) else (value,):
        if not isinstance(number, int | float):
            continue
        if (low is not None and number < low) or (high is not None and number > high):
            raise ConfigError(
                f"{name} = {values.number_text(number)} is out of range", f"choose {_range(low, high)}"
            )


def _allowed(kind: Any, low: float | None, high: float | None) -> str:
    if get_origin(kind) is Literal:
        return ", ".join(map(str, get_args(kind)))
    return _range(low, high) if (low, high) != (None, None) else ""


def _range(low: float | None, high: float | None) -> str:
    if low is not None and high is not None:
        return f"from {low} to {high}"
    return f"{low} or more" if high is None else f"{high} or less"
