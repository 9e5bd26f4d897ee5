"""Keys that shape how a texture learns to move."""

from unittest.mock import patch

import numpy as np
import pytest
import torch

from mitex.methods.nca.motion import pool as motion_pool
from mitex.methods.nca.motion import task as motion_task
from mitex.methods.nca.motion.tangent_field import TangentField, random_field
from mitex.methods.nca.motion.task import MotionTask
from mitex.methods.nca.motion.views import mesh_views
from tests.methods.nca.option_checks.registry import registry, step_loss

CHECKS, check = registry()

MOVING = ("motion=up", "motion_steps=1", "view_count=1")


def _motion(task, step=1, seed=0):
    """The motion term of one step from a pool of noise; None if there is none."""
    task.pool.copy_(torch.randn(task.pool.shape, generator=torch.Generator().manual_seed(1)))
    return step_loss(task, step, seed)[1].get("motion")


@check("motion")
def textures_that_move(build):
    assert [build(f"motion={field}").look.rule.condition for field in ("none", "up")] == [0, 3]


@check("motion_encoding")
def what_cells_know(build):
    told, untold = (build("motion=up", f"motion_encoding={on}").look.rule for on in ("true", "false"))
    assert (told.condition, untold.condition) == (3, 0)


@check("motion_advection")
def what_carries_states(build):
    """A rule that changes nothing leaves a state in its place, or it goes along with the field."""
    for carried in (False, True):
        task = build(*MOVING, f"motion_advection={carried}")
        state = torch.randn(task.pool[:1].shape, generator=torch.Generator().manual_seed(1))
        for weight in task.look.rule.parameters():
            weight.data.zero_()
        after = task.evolved(0, state, 4, torch.Generator().manual_seed(0))
        assert torch.equal(after, state) == (not carried)


@check("motion_weight")
def weight_of_motion(build):
    one, three = (_motion(build(*MOVING, f"motion_weight={weight}")) for weight in (1, 3))
    assert three == pytest.approx(3 * one, rel=1e-4) and one > 0


@check("motion_start")
def motion_begins_later(build):
    task = build(*MOVING, "motion_start=2")
    assert _motion(task, step=1) is None and _motion(task, step=2) > 0


@check("motion_period", "motion_steps")
def speed_of_motion(build):
    """Ways between two states are as many edges as there are steps in a part of the period."""
    for steps, period, expected in ((2, 4, 0.5), (3, 4, 0.75), (2, 16, 0.125)):
        settings = ("motion=up", "motion_advection=false", "min_steps=3")
        task = build(*settings, f"motion_steps={steps}", f"motion_period={period}")
        shares = []
        with patch.object(
            TangentField, "advection", lambda self, share, to=shares: to.append(share) or (lambda s: s + 1)
        ):
            _motion(task)
        assert shares == [expected]


@check("motion_turns", "motion_speeds")
def directions_and_speeds(build):
    sphere = build().surfaces[0]
    for turns, speeds in (("false", "1,1"), ("true", "2,3")):
        settings = build("motion=up", f"motion_turns={turns}", f"motion_speeds={speeds}").config
        field = random_field(settings, sphere, torch.Generator().manual_seed(0)).vectors
        unturned = np.abs(field[:, [0, 2]].mean(axis=0)).max() < 0.01
        assert unturned == (turns == "false")
        low, high = map(float, speeds.split(","))
        assert low - 1e-5 <= np.linalg.norm(field, axis=1).mean() <= high + 1e-5


@check("motion_estimator", "motion_gamma")
def motion_in_pictures(build):
    """Of an estimator that is nearly right: what the direction costs counts gamma times."""
    names, targets = [], []

    def load(name, device):
        names.append(name)
        return lambda first, second: 0.1 * targets[-1] + (second - first)

    def views(look, field, cameras):
        result = mesh_views(look, field, cameras)
        targets.append(result.target)
        return result

    loading = patch.object(motion_pool, "load_estimator", load)
    with loading, patch.object(motion_task, "mesh_views", views):
        settings = (*MOVING, "motion_estimator=lucas-kanade")
        tasks = [build(*settings, f"motion_gamma={gamma}") for gamma in (0.5, 4, 7.5)]
        losses = [_motion(MotionTask(task.config, task.exemplar)) for task in tasks]
    assert set(names) == {"lucas-kanade"}
    assert losses[2] - losses[1] == pytest.approx(losses[1] - losses[0], rel=1e-3) and losses[1] > losses[0]
