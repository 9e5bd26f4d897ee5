"""The one training loop: every method hands it a task."""

import logging
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from mitex.errors import ConfigError
from mitex.progress import announce
from mitex.runtime.cores import following_threads
from mitex.runtime.signals import StopSignals
from mitex.training import keeping, optim
from mitex.training.control import ALONE, Control, Progress
from mitex.training.errors import Cancelled, Interrupted, TrainingDiverged
from mitex.training.pace import Pace
from mitex.training.state import TrainState
from mitex.training.task import Task, Uneven

PATIENCE = 3  # non-finite steps in a row that end a run
log = logging.getLogger(__name__)


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
    out: str | Path | None,
    *,
    lr: float | Callable[[int], float],
    milestones: Sequence[int] = (),
    decay: float = 1.0,
    normalise_gradients: bool = False,
    optimizer: Callable[[Sequence[torch.Tensor]], optim.Optimizer] = optim.Adam,
    resume: bool = False,
    control: Control = ALONE,
) -> TrainResult:
    """Trains a task, and keeps a run folder from which it can go on after any end.

    A step whose loss or gradient is not finite is skipped: parameters, optimizer and task stay as they were.

    Args:
        task: The method's part.
        config: The method's resolved config, a flat dataclass with `steps`, `seed`, `checkpoint_every` (one
            more is saved at the end) and `preview_every` (one more is made at the end; 0 makes none).
        out: Run folder: missing, empty, or of a run that never reached a checkpoint; with `resume`, one with
            a checkpoint. None trains in memory and writes no file.
        lr: Learning rate, or a function from the step (from 0) to it.
        milestones: Steps from which on the learning rate is multiplied by `decay` once more.
        decay: Factor at each milestone.
        normalise_gradients: Divide each parameter tensor's gradient by its own norm + 1e-8.
        optimizer: Makes the optimizer of the task's parameters.
        resume: Go on from the folder's checkpoint. On one thread the result is bit-identical with that of an
            uninterrupted run. The config may differ in `mitex.training.state.FREE_KEYS` only.
        control: Is told of every step, and may stop the training.

    Returns:
        How the training ended.

    Raises:
        OutputError: The folder holds a run already (without `resume`), is in use, or cannot be written.
        CheckpointError: There is nothing to resume, or it belongs to another config or method.
        TrainingDiverged: Loss, gradients or a metric of `Task.begin` were not finite three steps in a row.
        Cancelled: By `control`; a checkpoint of the last whole step has been saved if there is a folder.
        Interrupted: SIGINT or SIGTERM; likewise. Only in the main thread.
    """
    if config.checkpoint_every < 1 or config.preview_every < 0:
        raise ConfigError("checkpoints and previews need a spacing", "set checkpoint_every to 1 or more")
    schedule = lr if callable(lr) else optim.multistep(lr, milestones, decay)
    with keeping.opened(out, resume, config.checkpoint_every, config.preview_every) as kept:
        state = TrainState(task, config, schedule, normalise_gradients, optimizer)
        kept.begin(state)
        announce("")  # the training shows itself
        tell = _teller(state, kept.place, control)
        with StopSignals() as stop, following_threads() as threads:
            while state.step < config.steps and not (stop.requested or control.cancelled):
                threads.look()
                record = state.advance()
                kept.write(record)
                if state.skipped >= PATIENCE:
                    raise _diverged(record, state, kept)
                kept.after_step(state, last=state.step == config.steps)
                tell(record)
            kept.save(state)
    if stop.requested:
        raise Interrupted(kept.checkpoint, state.step)
    if state.step < config.steps:
        raise Cancelled(kept.checkpoint, state.step)
    return TrainResult(state.step, state.loss, state.seconds)


def _teller(state: TrainState, place: str, control: Control) -> Callable[[dict[str, Any]], None]:
    """Tells the caller that the training starts; returns what tells of each step, given its record."""
    stage, steps = state.task.metadata().get("method", "training"), state.config.steps
    verb = f"continues at step {state.step} of {steps}" if state.step else f"starts, {steps} steps"
    log.info("%s %s; output in %s", stage, verb, place)
    cost = state.task.cost if isinstance(state.task, Uneven) else None
    pace = Pace(state.step, steps, time.monotonic(), cost)

    def tell(record: dict[str, Any]) -> None:
        if control.on_step is not None:
            measured = pace.measure(time.monotonic(), state.step) if record else {}
            progress = Progress(stage, state.step, steps, state.loss, record, state.seconds, **measured)
            control.on_step(progress)

    tell({})
    return tell


def _diverged(record: dict[str, Any], state: TrainState, kept: keeping.Recorder) -> TrainingDiverged:
    name = record["skipped"].replace("_", " ")
    again = "add `resume=True` and set" if kept.checkpoint else "set"
    return TrainingDiverged(
        f"the {name} was not finite in {PATIENCE} steps in a row, up to step {state.step}; "
        f"{kept.diverged(record, state)}",
        f"{again} a smaller learning rate, or another seed for a new run",
    )
