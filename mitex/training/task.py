"""What a method hands the training loop."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import torch


class Task(Protocol):
    """A method's part of a training: its parameters, its loss, and the state that a resumed run needs."""

    @property
    def parameters(self) -> Sequence[torch.Tensor]:
        """Leaf tensors to optimize, in a fixed order."""
        ...

    def loss(self, step: int, generator: torch.Generator) -> tuple[torch.Tensor, dict[str, float]]:
        """One forward pass: a scalar with a graph, and further numbers for metrics.jsonl.

        `step` counts from 0. All randomness comes from `generator` (CPU), so that a resumed run repeats it.
        """
        ...

    def commit(self) -> None:
        """Called after the update of a good step: the place to change state outside the parameters."""
        ...

    def state(self) -> dict[str, torch.Tensor]:
        """Everything a resumed run needs, parameters included; optimizer and generator are the loop's.

        Tensors may be the live ones, but must not share memory with each other.
        """
        ...

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        """Restores what `state` returned; KeyError, ValueError or RuntimeError when it does not fit.

        The tensors are the task's to keep.
        """
        ...

    def preview(self, step: int) -> np.ndarray | None:
        """A picture of the progress, (H, W, 3) sRGB in [0, 1], or None; `step` counts the steps done.

        It draws no random numbers of the run and leaves the state alone.
        """
        ...

    def metadata(self) -> dict[str, str]:
        """What is trained (`method`, exemplar, ...), the same throughout; a resumed run must match it."""
        ...
