"""The contract of a training task, as checks that the tests of every method share."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from unittest.mock import patch

import torch

from mitex.training import Task, checkpoint
from mitex.training.checkpoint import Checkpoint
from mitex.training.state import TrainState

FAULTS = ("loss", "gradient")


def copies(tensors: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    return {name: tensor.detach().clone() for name, tensor in tensors.items()}


def assert_same_bytes(one: Mapping[str, torch.Tensor], other: Mapping[str, torch.Tensor]) -> None:
    assert one.keys() == other.keys()
    for name in one:
        a, b = (tensors[name].detach() for tensors in (one, other))
        assert (a.dtype, a.shape) == (b.dtype, b.shape), name
        assert a.numpy().tobytes() == b.numpy().tobytes(), name


def assert_loss_is_pure(task: Task, step: int) -> None:
    """Two losses with the same random numbers are equal, and the state is not touched."""
    generator = torch.Generator().manual_seed(1)
    task.begin(step, generator)
    before, numbers = copies(task.state()), generator.get_state()
    first = task.loss(step, generator)
    assert_same_bytes(task.state(), before)
    generator.set_state(numbers)
    second = task.loss(step, generator)
    assert first.value.isfinite()
    assert torch.equal(first.value, second.value)
    assert first.metrics == second.metrics
    assert_same_bytes(task.state(), before)


def assert_steps_agree(one: Task, other: Task) -> None:
    """A step of two tasks that differ in the device alone; random numbers come from the CPU on both."""
    losses, gradients = [], []
    for task in (one, other):
        step = task.loss(1, torch.Generator().manual_seed(0))
        step.value.backward()
        step.commit()
        losses.append(step.value.item())
        gradients.append(torch.cat([p.grad.flatten().cpu() for p in task.parameters if p.grad is not None]))
    assert abs(losses[1] - losses[0]) < 1e-2 * abs(losses[0])
    assert torch.cosine_similarity(*gradients, dim=0) > 0.99


def with_nan_gradients(loss: torch.Tensor, parameters: Sequence[torch.Tensor]) -> torch.Tensor:
    """The same value."""
    for p in parameters:
        if p.requires_grad:
            loss = loss + (p - p.detach()).abs().sqrt().sum()  # 0, with a gradient of 0 / 0
    return loss


@contextmanager
def spoiled(task: Task, fault: str) -> Iterator[None]:
    """The task with NaN for its loss, or in the gradients of a finite loss."""
    sound = task.loss

    def loss(step, generator):
        result = sound(step, generator)
        if fault == "loss":
            return replace(result, value=result.value * math.nan)
        return replace(result, value=with_nan_gradients(result.value, task.parameters))

    with patch.object(task, "loss", loss):
        yield


def assert_third_step_leaves_no_trace(
    make: Callable[[], Task],
    config,
    fault: str,
    spoiled: Callable[[Task, str], AbstractContextManager[None]] = spoiled,
    first: int = 0,
) -> None:
    """A task whose third step fails has the bytes of one that never ran it, and goes on as that one does.

    `first` is the number of the first of the four steps.
    """
    failing, other = (TrainState(make(), config, lambda step: 1e-3, normalise=False) for _ in range(2))
    for state in (failing, other):
        state.step = first
        assert not any("skipped" in state.advance() for _ in range(2))
    with spoiled(failing.task, fault):
        assert failing.advance()["skipped"] == fault
    assert_same_state(failing.snapshot(), other.snapshot())
    before = [p.detach().clone() for p in other.task.parameters]
    other.step = failing.step
    other.generator.set_state(failing.generator.get_state())
    for state in (failing, other):
        assert "skipped" not in state.advance()
    assert_same_state(failing.snapshot(), other.snapshot())
    assert any(not torch.equal(a, b) for a, b in zip(before, other.task.parameters, strict=True))


def assert_same_state(one: Checkpoint, other: Checkpoint) -> None:
    """Task and optimizer, byte for byte, and the mean loss."""
    assert_same_bytes(one.task, other.task)
    assert_same_bytes(one.optimizer, other.optimizer)
    assert one.loss == other.loss


def assert_same_checkpoint(one, other) -> None:
    """The newest checkpoints of two run folders: every tensor, and the counters."""
    a, b = checkpoint.load(one), checkpoint.load(other)
    assert_same_state(a, b)
    assert torch.equal(a.generator, b.generator)
    assert (a.step, a.skipped) == (b.step, b.skipped)
