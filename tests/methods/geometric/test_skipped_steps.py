"""A skipped step leaves every byte as it was: of critics, of a level that begins, and of the checkpoint."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from unittest.mock import patch

import pytest

from mitex.methods.geometric.gan import critic_loss
from mitex.methods.geometric.task import GeometricTask
from mitex.runtime import threads
from mitex.training import checkpoint, train
from mitex.training.state import TrainState
from tests.methods.geometric.small import same_weights, small_task
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_state,
    assert_third_step_leaves_no_trace,
    spoiled,
    with_nan_gradients,
)

NEW_LEVEL = 6  # the step that begins level 3, whose networks start from those of level 2


def four_levels() -> GeometricTask:
    """Of two steps each, with two turns of the critic before each of them."""
    return small_task(steps=8, level_steps=2, carried=3, critic_steps=2, generator_steps=1)


@contextmanager
def spoiled_critic(task: GeometricTask, fault: str) -> Iterator[None]:
    """In its second turn the critic has NaN gradients of a finite loss."""
    turns = []

    def spoiled_loss(critic, *rest):
        turns.append(critic)
        loss, distance = critic_loss(critic, *rest)
        return (with_nan_gradients(loss, critic.parameters) if len(turns) == 2 else loss), distance

    with patch("mitex.methods.geometric.task.critic_loss", spoiled_loss):
        yield
    assert len(turns) == 2


@pytest.mark.parametrize(
    ("fault", "means"), [*((f, spoiled) for f in FAULTS), ("critic_gradient", spoiled_critic)]
)
def test_a_skipped_step_leaves_every_byte(fault, means):
    threads(1)
    config = four_levels().config
    assert_third_step_leaves_no_trace(four_levels, config, fault, means, first=NEW_LEVEL - 2)


def test_a_level_starts_from_the_one_below_even_if_its_first_step_is_skipped():
    task = four_levels()
    state = TrainState(task, task.config, lambda step: 0.0, normalise=False)
    state.step = NEW_LEVEL
    with spoiled(task, "loss"):
        assert "skipped" in state.advance()
    assert task.started == 0 and not same_weights(task.generators[3], task.generators[2])
    state.advance()
    assert task.started == 4 and same_weights(task.generators[3], task.generators[2])


def test_a_critic_that_is_not_finite_reaches_no_checkpoint(tmp_path):
    """That of six good steps and a seventh with a spoiled critic is that of the six."""
    checkpoints = []
    for steps in (NEW_LEVEL, NEW_LEVEL + 1):
        config = replace(four_levels().config, steps=steps, checkpoint_every=1, preview_every=0)
        task, resume = small_task(**vars(config)), steps > NEW_LEVEL
        with spoiled_critic(task, "critic_gradient") if resume else nullcontext():
            train(task, config, tmp_path, lr=1e-3, resume=resume)
        checkpoints.append(checkpoint.load(tmp_path))
    good, skipped = checkpoints
    assert (good.step, good.skipped, skipped.step, skipped.skipped) == (6, 0, 7, 1)
    assert_same_state(good, skipped)
    assert all(tensor.isfinite().all() for tensor in skipped.task.values())


@pytest.mark.parametrize("step", [0, NEW_LEVEL])
def test_the_loss_changes_nothing(step):
    assert_loss_is_pure(four_levels(), step)
