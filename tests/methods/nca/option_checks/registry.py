"""What tells that a key of the config counts, by key; and what the checks look at."""

import torch

# As many samples as there are places: the loss depends on no choice of them.
ALL_PLACES = ("samples=4096", "view_count=2", "pool=1", "blend=false", "min_steps=3", "max_steps=3")


def step_loss(task, step=1, seed=0):
    """(total, parts) of one step; step 1 does not inject the seed."""
    result = task.loss(step, torch.Generator().manual_seed(seed))
    return result.value, result.metrics


def appearance_loss(task, seed=0):
    return step_loss(task, seed=seed)[1]["appearance"]


def patch_cameras(task, size=32):
    return task.cameras(task.surfaces[0], size, torch.Generator().manual_seed(0))


def only_appearance(task):
    """The comparison of a task with one zoom."""
    (appearance,) = task.zooms.values()
    return appearance


def patch_views(task, state=None):
    """What two patches show of a state."""
    state = torch.zeros_like(task.pool[0]) if state is None else state
    return task.surfaces[0].views(task.look, state, patch_cameras(task))


def registry():
    """Checks by key, at first none; and what registers a function as the check of some keys."""
    checks = {}

    def check(*keys):
        def register(function):
            checks.update(dict.fromkeys(keys, function))
            return function

        return register

    return checks, check
