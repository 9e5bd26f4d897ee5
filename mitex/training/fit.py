"""One fit of whichever method: its settings, its place, its training, and the texture that it leaves."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, Unpack

from mitex.errors import ConfigError
from mitex.paths import expanded
from mitex.runtime.devices import available_device
from mitex.runtime.session import check_variant
from mitex.training import run
from mitex.training.config import by_key, resolve
from mitex.training.control import Control
from mitex.training.inputs import check_inputs
from mitex.training.locate import NAME
from mitex.training.loop import train
from mitex.training.settings import DeviceConfig, FitConfig, RunOptions
from mitex.training.task import Task

Config = TypeVar("Config", bound=FitConfig)


class Savable(Protocol):
    """What a fit needs of a texture."""

    def save(self, path: str | Path) -> Path:
        """Writes the model file."""
        ...


Learned = TypeVar("Learned", bound=Savable)


@dataclass(frozen=True)
class Run(Generic[Config]):
    """A fit whose folder and settings have been checked.

    Attributes:
        folder: The run folder; None for a fit in memory, which writes no files.
        config: Its resolved settings.
        resume: Whether it goes on from the folder's checkpoint.
        control: Its caller, who is told of every step and may stop it.
    """

    folder: Path | None
    config: Config
    resume: bool
    control: Control

    @staticmethod
    def of(
        presets: Mapping[str, Config], out: str | Path | None, **options: Unpack[RunOptions]
    ) -> Run[Config]:
        """Checks the folder and resolves the settings, before any long work; writes nothing.

        Args:
            presets: Of the method; the first one is the default.
            out: Run folder: new, empty, or one with a run to `resume`; None for a fit in memory.
            options: As of `RunOptions`.

        Returns:
            A fit; one that resumes has the settings of its own config.toml, if no other file is named.

        Raises:
            OutputError, CheckpointError: As `run.check`.
            ConfigError: As `resolve`; or the program has chosen a variant of Mitsuba that fits cannot use, or
                there is no such device.
        """
        folder, resume = None if out is None else expanded(out), options.get("resume", False)
        run.check(folder, resume)
        check_variant("ad_rgb")  # of the previews, at the latest
        named = options.get("config")
        file = None if named is None else expanded(named)
        if folder is not None and resume and file is None and (folder / run.CONFIG).is_file():
            file = folder / run.CONFIG
        config = resolve(presets, options.get("preset"), file, _settings(options))
        if isinstance(config, DeviceConfig):
            available_device(config.device)
        return Run(folder, config, resume, Control(options.get("on_step"), options.get("cancel")))

    def check_inputs(self, metadata: Mapping[str, str]) -> None:
        """Refuses to resume with other inputs than before, as `mitex.training.inputs.check_inputs`."""
        if self.resume and self.folder is not None:
            check_inputs(self.folder, metadata)

    def train(
        self, task: Task, name: str, texture: Callable[[dict[str, Any]], Learned], **training: Any
    ) -> Learned:
        """Trains, and saves the texture as `texture.safetensors` in the run folder if there is one.

        Args:
            task: The method's part of the training.
            name: Of what is learned.
            texture: Makes the texture, given what a model file tells of its training.
            training: Options of `train`: learning rate, schedule, optimizer.

        Raises:
            MitexError, Interrupted: As `train`; `Cancelled` is one of the former.
        """
        result = train(task, self.config, self.folder, resume=self.resume, control=self.control, **training)
        learned = texture(result.about(name, self.config.preset))
        if self.folder is not None:
            run.check_there(self.folder)
            learned.save(self.folder / NAME)
        return learned

    def compute(
        self, method: str, name: str, texture: Callable[[dict[str, Any]], Learned], **metadata: str
    ) -> Learned:
        """Saves a texture that needs no training in the run folder if there is one, with the settings beside.

        Args:
            method: By its name.
            name: Of what the texture shows.
            texture: Makes the texture, given what a model file tells of it.
            metadata: Further lines of config.toml's table `run`.

        Raises:
            OutputError: The folder cannot be used or written.
            Cancelled: The caller wanted to stop before the work began.
        """
        self.control.check()
        about = {"name": name, "preset": self.config.preset}
        if self.folder is None:
            return texture(about)
        began = time.monotonic()
        with run.opened(self.folder, self.resume) as (folder, metrics):
            run.prepare(folder, self.config, {"method": method, **metadata})
            computed = texture(about)
            seconds = round(time.monotonic() - began, 1)
            metrics.write({"step": 0, "seconds": seconds})
            run.check_there(folder)
            computed.save(folder / NAME)
        return computed


def _settings(options: RunOptions) -> dict[str, Any]:
    """The settings of `set`, `seed` and `steps`.

    Raises:
        ConfigError: Seed or steps are set twice, to different values.
    """
    settings = by_key(options.get("set", ()))
    for key in ("seed", "steps"):
        value = options.get(key)
        if value is not None and str(settings.setdefault(key, value)) != str(value):
            raise ConfigError(f"{key} is set to {settings[key]} and to {value}", "give it once")
    return settings
