"""What a training leaves as it goes: the files of a run folder, or nothing when it is in memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mitex.images import write_image
from mitex.records import write_json
from mitex.training import checkpoint, optim, run
from mitex.training.metrics import Metrics, plain
from mitex.training.state import TrainState


class Recorder:
    """What a training tells of its progress, kept in memory only: nothing is left but the result."""

    place = "memory"

    @property
    def checkpoint(self) -> Path | None:
        """The newest checkpoint."""
        return None

    def begin(self, state: TrainState) -> None:
        """Before the first step; brings a resumed state to its checkpoint."""

    def write(self, record: Mapping[str, Any]) -> None:
        """Keeps the numbers of a step."""

    def after_step(self, state: TrainState, last: bool) -> None:
        """Keeps checkpoints and previews when they are due."""

    def save(self, state: TrainState) -> None:
        """Keeps the state as a checkpoint, if that has not been done."""

    def diverged(self, record: Mapping[str, Any], state: TrainState) -> str:
        """Keeps the numbers of the step that ended the run, and says what there is to look at."""
        return "nothing has been kept"


class RunFolder(Recorder):
    """A training in a run folder, which is open.

    Args:
        folder: The folder.
        metrics: Its metrics.jsonl.
        resume: Whether it goes on from its checkpoint.
        checkpoint_every: Steps between two checkpoints.
        preview_every: Steps between two previews; 0 makes none.
    """

    def __init__(
        self, folder: Path, metrics: Metrics, resume: bool, checkpoint_every: int, preview_every: int
    ) -> None:
        self.place = str(folder)
        self._folder, self._metrics, self._resume = folder, metrics, resume
        self._checkpoint_every, self._preview_every = checkpoint_every, preview_every
        self._saved = -1  # step of the newest checkpoint

    @property
    def checkpoint(self) -> Path | None:
        path = self._folder / checkpoint.NAME
        return path if path.exists() else None

    def begin(self, state: TrainState) -> None:
        if self._resume:
            state.restore(checkpoint.load(self._folder))
            self._saved = state.step
        run.prepare(self._folder, state.config, state.task.metadata())
        self._metrics.truncate(state.step)

    def write(self, record: Mapping[str, Any]) -> None:
        self._metrics.write(record)

    def after_step(self, state: TrainState, last: bool) -> None:
        # In a row of skipped steps a checkpoint waits: the parameters may be what makes the loss non-finite.
        if last or (state.step % self._checkpoint_every == 0 and not state.skipped):
            self.save(state)
        if self._preview_every and (last or state.step % self._preview_every == 0):
            picture = state.task.preview(state.step)
            if picture is not None:
                run.check_there(self._folder)
                write_image(self._folder / run.PREVIEWS / f"{state.step:06}.png", picture)

    def save(self, state: TrainState) -> None:
        if self._saved != state.step:
            run.check_there(self._folder)
            self._metrics.sync()
            checkpoint.save(self._folder, state.snapshot())
            self._saved = state.step

    def diverged(self, record: Mapping[str, Any], state: TrainState) -> str:
        broken = record["skipped"] == "gradient"
        norms = optim.gradient_norms(state.optimizer.parameters).tolist() if broken else []
        place = self._folder / run.DIVERGED
        write_json(place, plain(record) | {"gradient_norms": [str(norm) for norm in norms]})
        newest = self.checkpoint
        last_good = f"the last good checkpoint is '{newest}'" if newest else "no checkpoint had been reached"
        return f"{last_good}, and '{place}' has the step's numbers"


@contextmanager
def opened(
    out: str | Path | None, resume: bool, checkpoint_every: int, preview_every: int
) -> Iterator[Recorder]:
    """The recorder of a training in a run folder; of one in memory if `out` is None.

    Raises:
        OutputError, CheckpointError: As `run.check`.
    """
    if out is None:
        run.check(None, resume)
        yield Recorder()
        return
    with run.opened(out, resume) as (folder, metrics):
        yield RunFolder(folder, metrics, resume, checkpoint_every, preview_every)
