"""The state of a training between two steps, and the step itself."""

import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import torch

from mitex.errors import CheckpointError
from mitex.training import optim
from mitex.training.checkpoint import Checkpoint
from mitex.training.inputs import KEY, refuse_other_inputs
from mitex.training.run import as_json
from mitex.training.task import Step, Task

SMOOTHING = 50  # steps over which the reported loss is averaged
FREE_KEYS = frozenset({"steps", "lr", "milestones", "decay", "checkpoint_every", "preview_every", "device"})


class TrainState:
    """Task, optimizer and random generator, advanced together one step at a time.

    Args:
        task: The method's part.
        config: The resolved config, with a `seed`.
        schedule: Learning rate by step from 0.
        normalise: Divide each parameter tensor's gradient by its own norm.
        optimizer: Makes the optimizer of the task's parameters.

    Attributes:
        step: Steps done.
        skipped: Steps skipped in a row, the last one included.
        loss: Loss averaged over about 50 steps; NaN before the first.
    """

    def __init__(
        self,
        task: Task,
        config: Any,
        schedule: Callable[[int], float],
        normalise: bool,
        optimizer: Callable[[Sequence[torch.Tensor]], optim.Optimizer] = optim.Adam,
    ):
        self.task = task
        self.config = config
        self.schedule = schedule
        self.normalise = normalise
        self.optimizer = optimizer(task.parameters)
        self.generator = torch.Generator().manual_seed(config.seed)
        self.step = 0
        self.skipped = 0
        self.loss = math.nan
        self._earlier = 0.0
        self._began = time.monotonic()

    @property
    def seconds(self) -> float:
        """Time spent training, in earlier parts of the run too [s]."""
        return self._earlier + time.monotonic() - self._began

    def advance(self) -> dict[str, Any]:
        """One step: begin, forward, backward, update; returns its line for metrics.jsonl.

        When the loss, a gradient or a metric of `begin` is not finite, the line says which under `skipped`,
        and parameters, optimizer and task are what they were, byte for byte. Only the counters go on, and the
        generator, so that the next step draws other numbers.
        """
        self.optimizer.clear()
        change = self.task.begin(self.step, self.generator)
        metrics = dict(change.metrics) if change else {}
        fault = next((name for name, number in metrics.items() if not math.isfinite(number)), None)
        loss = math.nan
        if fault is None:
            step = self.task.loss(self.step, self.generator)
            loss = step.value.item()
            metrics |= step.metrics
            fault = self._update(step, loss)
        if fault and change:
            change.undo()
        self.skipped = self.skipped + 1 if fault else 0
        self.step += 1
        record: dict[str, Any] = {"step": self.step, "loss": loss}
        record |= {name: float(number) for name, number in metrics.items() if name not in record}
        record["seconds"] = round(self.seconds, 3)
        return record | ({"skipped": fault} if fault else {})

    def _update(self, step: Step, loss: float) -> str | None:
        """Backward pass and update; what is not finite, if anything, before the first change."""
        if not math.isfinite(loss):
            return "loss"
        step.value.backward()
        norms = optim.gradient_norms(self.optimizer.parameters)
        if not norms.isfinite().all():
            return "gradient"
        if self.normalise:
            optim.normalise_gradients(self.optimizer.parameters, norms)
        self.optimizer.step(self.schedule(self.step))
        step.commit()
        mean = loss if math.isnan(self.loss) else self.loss
        self.loss = mean + (loss - mean) / min(self.step + 1, SMOOTHING)
        return None

    def snapshot(self) -> Checkpoint:
        """The whole state; its tensors are the live ones, not copies."""
        return Checkpoint(
            step=self.step,
            seconds=self.seconds,
            loss=self.loss,
            skipped=self.skipped,
            config=as_json(self.config),
            task=self.task.state(),
            optimizer=self.optimizer.state(),
            generator=self.generator.get_state(),
            metadata=self.task.metadata(),
        )

    def restore(self, saved: Checkpoint) -> None:
        """Continues from a checkpoint.

        Raises:
            CheckpointError: It is of another method, exemplar, config or shape.
        """
        remedy = "resume with the settings it was made with, or name another `out`"
        metadata = self.task.metadata()
        for old, new in ((saved.metadata, metadata), (saved.config, as_json(self.config))):
            for key in sorted(old.keys() | new.keys()):
                if key not in FREE_KEYS and not key.endswith(KEY) and old.get(key) != new.get(key):
                    was, now = old.get(key, "nothing"), new.get(key, "nothing")
                    raise CheckpointError(f"the checkpoint was made with {key} {was!r}, not {now!r}", remedy)
        refuse_other_inputs(saved.metadata, metadata)
        try:
            self.optimizer.load_state(saved.optimizer)
            self.generator.set_state(saved.generator)
            self.task.load_state(saved.task)
        except (KeyError, ValueError, RuntimeError) as e:
            raise CheckpointError(f"the checkpoint does not fit this model ({e})", remedy) from e
        self.step, self.skipped, self.loss = saved.step, saved.skipped, saved.loss
        self._earlier = saved.seconds
