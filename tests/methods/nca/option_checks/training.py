"""Keys that shape the rule, the pool, the surfaces and the exemplar."""

from typing import Any

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.methods.nca.task import NcaTask
from tests.methods.nca.option_checks.registry import only_appearance, patch_cameras, registry, step_loss

CHECKS, check = registry()


@check("channels", "hidden", "degree")
def shape_of_the_model(build):
    model = build("channels=13", "hidden=9", "degree=2").look.rule
    assert model.fc1.weight.shape == (9, (9 + 1) * 13) and model.fc2.weight.shape == (13, 9)


@check("gain")
def first_weights_are_proportional_to_the_gain(build):
    small, large = (build(f"gain={gain}").look.rule.fc2.weight for gain in (0.1, 0.3))
    assert torch.allclose(3 * small, large)


@check("seed")
def seeds_give_other_weights(build):
    assert not torch.equal(build("seed=1").look.rule.fc1.weight, build("seed=2").look.rule.fc1.weight)


@check("frequency", "pool")
def pool_of_states_on_the_sphere(build):
    task = build("frequency=7", "pool=3", "density=7")
    assert len(task.surfaces[0].mesh.vertices) == 10 * 7**2 + 2
    assert task.pool.shape == (3, 492, 16)


@check("min_steps", "max_steps", "inject_every")
def rollouts(build):
    """All numbers of steps between the ends, both included, and the seed every so often."""
    task = build("min_steps=5", "max_steps=7", "inject_every=4", "view_count=1")
    task.pool.fill_(0.1)
    calls = []

    def evolve(state, perception, steps, generator):
        calls.append((bool(state.any()), steps))
        return state

    task.look.rule.evolve = evolve
    for step in range(16):
        step_loss(task, step, seed=step)
    assert {steps for _, steps in calls} == {5, 6, 7}
    assert [any_ for any_, _ in calls] == [step % 4 != 0 for step in range(16)]


@check("views", "view_count", "resolution")
def cameras(build):
    patch, full = (build(f"views={views}", "view_count=3", "resolution=24") for views in ("patch", "full"))
    assert (patch_cameras(patch).kind, patch_cameras(patch).shape) == ("orthographic", (3, 24, 24))
    assert (patch_cameras(full).kind, patch_cameras(full).shape) == ("perspective", (3, 24, 24))


@check("distance", "fov")
def full_views(build):
    cameras = patch_cameras(build("views=full", "distance=3.5", "fov=40"))
    assert np.linalg.norm(cameras.origin, axis=1) == pytest.approx(3.5, abs=1e-4)
    assert cameras.fov == 40


@check("density")
def vertices_along_the_exemplar(build):
    coarse, fine = build("density=4"), build("density=8")
    assert patch_cameras(fine).half_width == pytest.approx(2 * patch_cameras(coarse).half_width)


@check("exemplar_size", "zooms")
def sizes_of_the_exemplar(build):
    """Each zoom has twice the pixels of the one before, up to those of the exemplar."""
    settings = ("exemplar_size=256", "target_size=0", "layers=relu1_1")
    assert list(build(*settings, "zooms=2").zooms) == [128, 256]
    assert list(build(*settings).zooms) == [256]
    assert list(build("exemplar_size=24", *settings[1:]).zooms) == [24]
    targets = build(*settings, "zooms=2").zooms[128].targets
    assert targets.size("colour") == 128**2


@check("target_size")
def size_at_which_features_see_the_exemplar(build):
    assert only_appearance(build("target_size=48")).targets.size("colour") == 48**2


@check("blend")
def mixed_pictures(build):
    kinds = [
        {p.kind for p in only_appearance(build(f"blend={b}")).targets.pictures} for b in ("true", "false")
    ]
    assert "mix" in kinds[0] and "mix" not in kinds[1]


@check("surfaces")
def surfaces(build):
    """In the order of the words; each further plane faces another way."""
    several = build("surfaces=even,flat,uneven,flat").surfaces
    assert len(several) == 4
    even, flat, uneven, other = several
    spreads = [_edge_lengths(sphere.mesh) for sphere in (even, uneven)]
    assert [bool(one.std() > 0.2 * one.mean()) for one in spreads] == [False, True]
    facing = [plane.lattice.mesh.normals.mean(axis=0) for plane in (flat, other)]
    assert np.allclose(facing, [[0, 0, 1], [1, 0, 0]], atol=1e-6)
    assert len(build("surfaces=uneven").surfaces) == 1


def _edge_lengths(mesh):
    return np.linalg.norm(mesh.vertices[mesh.edges.indices] - mesh.vertices[mesh.edges.rows], axis=1)


@check("relief_weight")
def normals_that_follow_from_heights(build):
    """Counts on flat surfaces only, where the exemplar has both maps."""

    maps = Exemplar.load("scales").resized(32).maps
    exemplar = Exemplar({name: maps[name] for name in ("height", "normal")}, "scales")
    for surface, weight, expected in (
        ("flat", 3, 0.75),
        ("flat", 1, 0.25),
        ("flat", 0, None),
        ("even", 1, None),
    ):
        task: Any = NcaTask(build(f"surfaces={surface}", f"relief_weight={weight}").config, exemplar)
        assert (task.relief is None) == (weight == 0)
        task.relief = task.relief and (lambda views, _: views.new_tensor(0.25))
        assert step_loss(task)[1].get("relief") == expected
    assert build("surfaces=flat").relief is None  # the exemplar has no normals
