"""What a method hands the training loop.

A step has three parts, so that one that fails leaves no trace: `Task.begin` changes what the loss needs and
says how to undo it, `Task.loss` changes nothing, and `Step.commit` changes what follows from a good update.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
import torch


@dataclass(frozen=True, eq=False)
class Change:
    """What `Task.begin` changed.

    Attributes:
        undo: Brings back every byte of what was changed.
        metrics: Numbers for metrics.jsonl. If one of them is not finite, the step is skipped.
    """

    undo: Callable[[], None]
    metrics: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Step:
    """What `Task.loss` returns.

    Attributes:
        value: The loss, a scalar with a graph.
        metrics: Further numbers for metrics.jsonl.
        commit: Called after the update of a good step: the place to change state by what the step computed,
            or to project the parameters.
    """

    value: torch.Tensor
    metrics: Mapping[str, float] = field(default_factory=dict)
    commit: Callable[[], None] = lambda: None


class Task(Protocol):
    """A method's part of a training: its parameters, its loss, and the state that a resumed run needs."""

    @property
    def parameters(self) -> Sequence[torch.Tensor]:
        """Leaf tensors to optimize, in a fixed order."""
        ...

    def begin(self, step: int, generator: torch.Generator) -> Change | None:
        """Changes the state that the loss of this step needs: a critic, an occupancy grid, the next level.

        Called once before each `loss`, with the same arguments. None says that nothing was changed. Any step
        may be skipped, so what is due once must not wait for one certain `step`.
        """
        ...

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """One forward pass, which changes nothing but `generator`.

        `step` counts from 0. All randomness comes from `generator` (CPU), so that a resumed run repeats it.
        """
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
        """What is trained (`method`, exemplar, ...), the same throughout; a resumed run must match it.

        `NAME_key` is a hash of the content of the input `NAME`, which tells others of that name apart.
        """
        ...


@runtime_checkable
class Uneven(Protocol):
    """A task whose steps take more or less time by what they work on, which the time left accounts for."""

    def cost(self, step: int) -> float:
        """What a step costs beside the others, in any unit, above 0."""
        ...


class ParameterTask:
    """The parts of a task whose state is its parameters alone; a subclass adds `loss` and `metadata`.

    Args:
        named: Leaf tensors by name, in a fixed order; they are made to require gradients.

    Attributes:
        named: The same.
    """

    def __init__(self, named: Mapping[str, torch.Tensor]) -> None:
        self.named = {name: value.requires_grad_() for name, value in named.items()}

    @property
    def parameters(self) -> Sequence[torch.Tensor]:
        return list(self.named.values())

    def begin(self, step: int, generator: torch.Generator) -> Change | None:
        """Changes nothing."""

    def state(self) -> dict[str, torch.Tensor]:
        return {name: value.detach() for name, value in self.named.items()}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        with torch.no_grad():
            for name, value in self.named.items():
                if state[name].shape != value.shape:
                    raise ValueError(f"{name} of shape {tuple(state[name].shape)}")
                value.copy_(state[name])

    def preview(self, step: int) -> np.ndarray | None:
        """No picture."""
