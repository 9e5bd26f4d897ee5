"""The one training loop: every method hands it a task."""

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from mitex.errors import ConfigError
from mitex.images import write_image
from mitex.paths import atomic_write
from mitex.progress import announce
from mitex.training import checkpoint, optim, run
from mitex.training.errors import Interrupted, TrainingDiverged
from mitex.training.metrics import Metrics, plain
from mitex.training.progress import Progress
from mitex.training.signals import StopSignals
from mitex.training.state import TrainState
from mitex.training.task import Task, Uneven

PATIENCE = 3  # non-finite steps in a row that end a run


@dataclass(frozen=True)
class TrainResult:
    """How a training ended.

    Attributes:
        steps: Steps done, those of earlier parts included.
        loss: Loss, averaged over about the last 50 steps; NaN if there was none.
        seconds: Time spent in all parts [s].
    """

    steps: int
    loss: float
    seconds: float

    def about(self, name: str, preset: str) -> dict[str, Any]:
        """What a model file tells of its training, as JSON values; `name` is that of what was learned."""
        about = {"name": name, "preset": preset, "steps": self.steps, "seconds": round(self.seconds, 1)}
        return about | ({"loss": float(f"{self.loss:.6g}")} if math.isfinite(self.loss) else {})


def train(
    task: Task,
    config: Any,
    out: str | Path,
    *,
    lr: float | Callable[[int], float],
    milestones: Sequence[int] = (),
    decay: float = 1.0,
    normalise_gradients: bool = False,
    optimizer: Callable[[Sequence[torch.Tensor]], optim.Optimizer] = optim.Adam,
    resume: bool = False,
    quiet: bool = False,
) -> TrainResult:
    """Trains a task, and keeps a run folder from which it can go on after any end.

    A step whose loss or gradient is not finite is skipped: parameters, optimizer and task stay as they were.

    Args:
        task: The method's part.
        config: The method's resolved config, a flat dataclass with `steps`, `seed`, `checkpoint_every` (one
            more is saved at the end) and `preview_every` (one more is made at the end; 0 makes none).
        out: Run folder: missing, empty, or of a run that never reached a checkpoint; with `resume`, one with
            a checkpoint.
        lr: Learning rate, or a function from the step (from 0) to it.
        milestones: Steps from which on the learning rate is multiplied by `decay` once more.
        decay: Factor at each milestone.
        normalise_gradients: Divide each parameter tensor's gradient by its own norm + 1e-8.
        optimizer: Makes the optimizer of the task's parameters.
        resume: Go on from the folder's checkpoint. On one thread the result is bit-identical with that of an
            uninterrupted run. The config may differ in `mitex.training.state.FREE_KEYS` only.
        quiet: Show no progress.

    Returns:
        How the training ended.

    Raises:
        OutputError: The folder holds a run already (without `resume`), is in use, or cannot be written.
        CheckpointError: There is nothing to resume, or it belongs to another config or method.
        TrainingDiverged: Loss, gradients or a metric of `Task.begin` were not finite three steps in a row.
        Interrupted: SIGINT or SIGTERM; a checkpoint of the last whole step has been saved.
    """
    if config.checkpoint_every < 1 or config.preview_every < 0:
        raise ConfigError("checkpoints and previews need a spacing", "set checkpoint_every to 1 or more")
    schedule = lr if callable(lr) else optim.multistep(lr, milestones, decay)
    with run.opened(out, resume) as (folder, metrics):
        state = TrainState(task, config, schedule, normalise_gradients, optimizer)
        if resume:
            state.restore(checkpoint.load(folder))
        run.prepare(folder, config, task.metadata())
        metrics.truncate(state.step)
        every = config.checkpoint_every, config.preview_every
        writer = _Writer(folder, state, metrics, *every, saved=state.step if resume else -1)
        announce("")  # the training shows itself
        title = task.metadata().get("method", "training")
        cost = task.cost if isinstance(task, Uneven) else None
        with (
            Progress(title, folder, state.step, config.steps, quiet, cost=cost) as progress,
            StopSignals(quiet) as stop,
        ):
            while state.step < config.steps and not stop.requested:
                record = state.advance()
                metrics.write(record)
                progress.update(state.step, state.loss)
                if state.skipped >= PATIENCE:
                    raise _diverged(folder, record, state)
                writer.after_step(last=state.step == config.steps)
            writer.save()
    if stop.requested:
        raise Interrupted(folder / checkpoint.NAME, state.step)
    return TrainResult(state.step, state.loss, state.seconds)


@dataclass
class _Writer:
    """Saves checkpoints and previews when they are due; `saved` is the step of the newest checkpoint."""

    folder: Path
    state: TrainState
    metrics: Metrics
    checkpoint_every: int
    preview_every: int
    saved: int

    def after_step(self, last: bool) -> None:
        step = self.state.step
        # In a row of skipped steps a checkpoint waits: the parameters may be what makes the loss non-finite.
        if last or (step % self.checkpoint_every == 0 and not self.state.skipped):
            self.save()
        if self.preview_every and (last or step % self.preview_every == 0):
            picture = self.state.task.preview(step)
            if picture is not None:
                write_image(self.folder / run.PREVIEWS / f"{step:06}.png", picture)

    def save(self) -> None:
        if self.saved != self.state.step:
            self.metrics.sync()
            checkpoint.save(self.folder, self.state.snapshot())
            self.saved = self.state.step


def _diverged(folder: Path, record: dict[str, Any], state: TrainState) -> TrainingDiverged:
    kind = record["skipped"]
    norms = optim.gradient_norms(state.optimizer.parameters).tolist() if kind == "gradient" else []
    with atomic_write(folder / run.DIVERGED) as temporary:
        dump = plain(record) | {"gradient_norms": [str(norm) for norm in norms]}
        temporary.write_text(json.dumps(dump, indent=1) + "\n", encoding="utf-8")
    name = kind.replace("_", " ")
    newest = folder / checkpoint.NAME
    last_good, again = "no checkpoint had been reached", "set"
    if newest.exists():
        last_good, again = f"the last good checkpoint is '{newest}'", "add --resume and set"
    return TrainingDiverged(
        f"the {name} was not finite in {PATIENCE} steps in a row, up to step {state.step}; {last_good}, and "
        f"'{folder / run.DIVERGED}' has the step's numbers",
        f"{again} a smaller learning rate, or another seed for a new run",
    )
