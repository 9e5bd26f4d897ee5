"""Every key of the config does what it says: each check fails where its key is ignored."""

from dataclasses import fields

import pytest
import torch

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.methods import nca
from mitex.methods.nca import NcaConfig
from mitex.methods.nca.motion.task import MotionTask
from mitex.methods.nca.task import NcaTask
from mitex.runtime import threads
from tests.methods.nca.option_checks import decoder, losses, motion, training
from tests.methods.nca.tiny import SETTINGS, config

CHECKS = training.CHECKS | decoder.CHECKS | losses.CHECKS | motion.CHECKS
pytestmark = pytest.mark.usefixtures("quick_settling")


@pytest.fixture(scope="module")
def exemplar():
    maps = Exemplar.load("scales").resized(256).maps
    return Exemplar({name: maps[name] for name in ("albedo", "height")}, "scales")


@pytest.fixture(scope="module")
def build(exemplar):
    """A task with some settings; the same task for the same settings."""
    tasks: dict[tuple[str, ...], NcaTask] = {}

    def build(*settings: str) -> NcaTask:
        if settings not in tasks:
            resolved = config(*settings)
            tasks[settings] = (MotionTask if resolved.motion else NcaTask)(resolved, exemplar)
        return tasks[settings]

    return build


@pytest.mark.parametrize("key", sorted(CHECKS))
def test_the_check_of_a_key_holds(build, key):
    """The assertions are those of the function in `option_checks` that is registered for the key."""
    CHECKS[key](build)


@pytest.mark.parametrize("key", sorted(CHECKS))
def test_the_check_of_a_key_fails_where_it_is_ignored(build, key):
    """As a task would behave that never reads the key: it is what it is without that setting."""

    def without_key(*settings: str) -> NcaTask:
        return build(*(setting for setting in settings if not setting.startswith(f"{key}=")))

    with pytest.raises((AssertionError, ConfigError)):  # ConfigError: max_steps below the default min_steps
        CHECKS[key](without_key)


OF_THE_FIT = {"lr", "milestones", "decay", "normalise_gradients"}
OF_THE_LOOP = {"preset", "steps", "checkpoint_every", "preview_every"}  # tests/training
OF_THE_DEVICE = {"device"}  # test_device


def test_no_key_is_left_out():
    keys = {field.name for field in fields(NcaConfig) if field.name.partition("_")[0] != "text"}
    assert keys == set(CHECKS) | OF_THE_FIT | OF_THE_LOOP | OF_THE_DEVICE  # text/test_options has the others


@pytest.fixture
def fitted(tmp_path, exemplar):
    """The weights after a fit with some settings, as one vector."""
    threads(1)

    def fitted(*settings: str) -> torch.Tensor:
        out = tmp_path / "-".join(settings)
        texture = nca.fit(exemplar, out, set=[*SETTINGS, *settings])
        return torch.cat([p.detach().flatten() for p in texture.look.parameters()])

    return fitted


def test_first_step_of_adam_is_as_long_as_the_learning_rate(fitted):
    start = fitted("steps=0")
    for lr in (1e-3, 4e-3):
        assert (fitted("steps=1", f"lr={lr}") - start).abs().max().item() == pytest.approx(lr, rel=1e-2)


def test_learning_rate_decays_at_the_milestones(fitted):
    """To nothing after the first step, or not at all."""
    once = fitted("steps=1")
    assert torch.equal(fitted("steps=3", "milestones=1", "decay=0"), once)
    assert not torch.equal(fitted("steps=3", "milestones=2", "decay=0"), once)
    assert not torch.equal(fitted("steps=3", "milestones=1", "decay=0.5"), once)


def test_normalised_gradients_give_another_fit(fitted):
    """Adam forgets a constant scale, but not one that changes from step to step."""
    weights = [fitted("steps=4", f"normalise_gradients={on}") for on in ("true", "false")]
    assert (weights[0] - weights[1]).abs().max() > 1e-4
