"""One fit of whichever method: its settings, its run folder, its training, and the texture that it leaves."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, Unpack

from mitex.paths import expanded
from mitex.training import run
from mitex.training.config import resolve
from mitex.training.inputs import check_inputs
from mitex.training.locate import NAME
from mitex.training.loop import train
from mitex.training.settings import FitConfig, RunOptions
from mitex.training.task import Task

Config = TypeVar("Config", bound=FitConfig)


class Saved(Protocol):
    """What a fit needs of a texture."""

    def save(self, path: str | Path) -> Path:
        """Writes the model file."""
        ...


Learned = TypeVar("Learned", bound=Saved)


@dataclass(frozen=True)
class Run(Generic[Config]):
    """A fit whose folder and settings have been checked.

    Attributes:
        folder: The run folder.
        config: Its resolved settings.
        resume: Whether it goes on from the folder's checkpoint.
        quiet: Whether no progress is shown.
    """

    folder: Path
    config: Config
    resume: bool
    quiet: bool

    @staticmethod
    def of(presets: Mapping[str, Config], out: str | Path, **options: Unpack[RunOptions]) -> Run[Config]:
        """Checks the folder and resolves the settings, before any long work; writes nothing.

        Args:
            presets: Of the method; the first one is the default.
            out: Run folder: new, empty, or one with a run to `resume`.
            options: As of `RunOptions`.

        Returns:
            A fit; one that resumes has the settings of its own config.toml, if no other file is named.

        Raises:
            OutputError, CheckpointError: As `run.check`.
            ConfigError: As `resolve`.
        """
        folder, resume = expanded(out), options.get("resume", False)
        run.check(folder, resume)
        own, file = folder / run.CONFIG, options.get("config")
        if resume and file is None and own.is_file():
            file = own
        config = resolve(presets, options.get("preset"), file, options.get("overrides", ()))
        return Run(folder, config, resume, options.get("quiet", False))

    def check_inputs(self, metadata: Mapping[str, str]) -> None:
        """Refuses to resume with other inputs than before, as `mitex.training.inputs.check_inputs`."""
        if self.resume:
            check_inputs(self.folder, metadata)

    def train(
        self, task: Task, name: str, texture: Callable[[dict[str, Any]], Learned], **training: Any
    ) -> Learned:
        """Trains, and saves the texture as `texture.safetensors` in the run folder.

        Args:
            task: The method's part of the training.
            name: Of what is learned.
            texture: Makes the texture, given what a model file tells of its training.
            training: Options of `train`: learning rate, schedule, optimizer.

        Raises:
            MitexError, Interrupted: As `train`.
        """
        result = train(task, self.config, self.folder, resume=self.resume, quiet=self.quiet, **training)
        learned = texture(result.about(name, self.config.preset))
        learned.save(self.folder / NAME)
        return learned

    def compute(
        self, method: str, name: str, texture: Callable[[dict[str, Any]], Learned], **metadata: str
    ) -> Learned:
        """Saves a texture that needs no training in the run folder, with the settings beside it.

        Args:
            method: By its name.
            name: Of what the texture shows.
            texture: Makes the texture, given what a model file tells of it.
            metadata: Further lines of config.toml's table `run`.

        Raises:
            OutputError: The folder cannot be used or written.
        """
        began = time.monotonic()
        with run.opened(self.folder, self.resume) as (folder, metrics):
            run.prepare(folder, self.config, {"method": method, **metadata})
            about = {"name": name, "preset": self.config.preset}
            computed = texture(about)
            seconds = round(time.monotonic() - began, 1)
            metrics.write({"step": 0, "seconds": seconds})
            computed.save(folder / NAME)
        return computed
