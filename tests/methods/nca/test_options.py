"""Every key of the config does what it says: each check fails where its key is ignored."""

from dataclasses import fields
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.methods import nca
from mitex.methods.nca import NcaConfig
from mitex.methods.nca.motion import pool as motion_pool
from mitex.methods.nca.motion import task as motion_task
from mitex.methods.nca.motion.tangent_field import TangentField, random_field
from mitex.methods.nca.motion.task import MotionTask
from mitex.methods.nca.motion.views import mesh_views
from mitex.methods.nca.task import NcaTask
from mitex.runtime import threads
from tests.methods.nca.tiny import SETTINGS, config

pytestmark = pytest.mark.usefixtures("quick_settling")

# As many samples as there are places: the loss depends on no choice of them.
ALL_PLACES = ("samples=4096", "view_count=2", "pool=1", "blend=false", "min_steps=3", "max_steps=3")


@pytest.fixture(scope="module")
def exemplar():
    maps = Exemplar.load("scales").maps
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


def _loss(task, step=1, seed=0):
    """(total, parts) of one step; step 1 does not inject the seed."""
    result = task.loss(step, torch.Generator().manual_seed(seed))
    return result.value, result.metrics


def _appearance(task, seed=0):
    return _loss(task, seed=seed)[1]["appearance"]


def _cameras(task, size=32):
    return task.cameras(task.surfaces[0], size, torch.Generator().manual_seed(0))


def _only(task):
    """The comparison of a task with one zoom."""
    (appearance,) = task.zooms.values()
    return appearance


def _views(task, state=None):
    """What two patches show of a state."""
    state = torch.zeros_like(task.pool[0]) if state is None else state
    return task.surfaces[0].views(task.look, state, _cameras(task))


# One entry for each key that shapes the task: what tells that it counts.
CHECKS = {}


def check(*keys):
    def register(function):
        CHECKS.update(dict.fromkeys(keys, function))
        return function

    return register


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
        _loss(task, step, seed=step)
    assert {steps for _, steps in calls} == {5, 6, 7}
    assert [any_ for any_, _ in calls] == [step % 4 != 0 for step in range(16)]


@check("views", "view_count", "resolution")
def cameras(build):
    patch, full = (build(f"views={views}", "view_count=3", "resolution=24") for views in ("patch", "full"))
    assert (_cameras(patch).kind, _cameras(patch).shape) == ("orthographic", (3, 24, 24))
    assert (_cameras(full).kind, _cameras(full).shape) == ("perspective", (3, 24, 24))


@check("distance", "fov")
def full_views(build):
    cameras = _cameras(build("views=full", "distance=3.5", "fov=40"))
    assert np.linalg.norm(cameras.origin, axis=1) == pytest.approx(3.5, abs=1e-4)
    assert cameras.fov == 40


@check("density")
def vertices_along_the_exemplar(build):
    coarse, fine = build("density=4"), build("density=8")
    assert _cameras(fine).half_width == pytest.approx(2 * _cameras(coarse).half_width)


@check("exemplar_size", "zooms")
def sizes_of_the_exemplar(build):
    """Each zoom has twice the pixels of the one before, up to those of the exemplar."""
    settings = ("exemplar_size=256", "target_size=0")
    assert list(build(*settings, "zooms=2").zooms) == [128, 256]
    assert list(build(*settings).zooms) == [256]
    assert list(build("exemplar_size=24", "target_size=0").zooms) == [24]
    targets = build(*settings, "zooms=2").zooms[128].targets
    assert targets.size("colour") == 128**2


@check("target_size")
def size_at_which_features_see_the_exemplar(build):
    assert _only(build("target_size=48")).targets.size("colour") == 48**2


@check("blend")
def mixed_pictures(build):
    kinds = [{p.kind for p in _only(build(f"blend={b}")).targets.pictures} for b in ("true", "false")]
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
        assert _loss(task)[1].get("relief") == expected
    assert build("surfaces=flat").relief is None  # the exemplar has no normals


@check("aggregation")
def aggregation(build):
    """At the icosphere's vertices of valence 5 the mean is larger."""
    mean, total = (build(f"aggregation={a}") for a in ("mean", "sum"))
    assert (mean.look.mean, total.look.mean) == (True, False)
    state = torch.rand(1, 642, 16, generator=torch.Generator().manual_seed(0))
    ratio = (mean.surfaces[0].perception(state) / total.surfaces[0].perception(state))[0, :, 0]
    valence = torch.from_numpy(np.diff(mean.surfaces[0].mesh.edges.indptr))
    assert torch.allclose(ratio, 6 / valence, rtol=1e-3)


@check("decoder")
def maps_without_a_decoder_are_channels(build):
    assert [len(build(f"decoder={on}").parameters) for on in ("true", "false")] == [12, 4]
    assert torch.equal(_views(build("decoder=false")), torch.full((4, 32, 32, 4), 0.5))


@check("decoder_width", "decoder_depth")
def layers_of_the_decoder(build):
    shapes = [tuple(p.shape) for p in build("decoder_width=7", "decoder_depth=1").parameters[4:]]
    assert shapes == [(7, 24), (7,), (4, 7), (4,)]


@check("coordinates")
def inputs_of_the_decoder(build):
    for words, extra in (("", 0), ("waves", 8), ("polynomials,waves", 10), ("barycentrics,polynomials", 5)):
        assert build(f"coordinates={words}").look.decoder.network.layers[0].in_features == 16 + extra


@check("waves", "wave_frequencies", "wave_amplitude")
def grain(build):
    waves = build("waves=5", "wave_frequencies=0.5,4", "wave_amplitude=0.7").look.decoder.waves
    lengths = waves.vectors.norm(dim=1)
    assert lengths.tolist() == pytest.approx([0.5, 4, 0.5, 4, 0.5]) and waves.amplitude == 0.7


@check("omega")
def bends_of_the_decoder(build):
    """It multiplies what enters a sine; initial weights behind the first layer are divided by it."""
    low, high = (build(f"omega={omega}").look.decoder.network for omega in (2, 30))
    assert torch.allclose(2 * low.layers[1].weight, 30 * high.layers[1].weight)
    assert (low.omega, high.omega) == (2, 30)


@check("interpolation")
def creases_of_the_state(build):
    """Seen close up, slopes of a linear one jump at the edges."""
    state = torch.rand(642, 16, generator=torch.Generator().manual_seed(0)) - 0.5
    jumps = {}
    for kind in ("smooth", "linear"):
        task = build(f"interpolation={kind}", "coordinates=", "resolution=64")
        lines = task.surfaces[0].views(task.look, state, _cameras(task, 512))
        bends = lines.diff(n=2, dim=2).abs()
        jumps[kind] = (bends.amax() / bends.mean()).item()
    assert jumps["linear"] > 2 * jumps["smooth"]


@check("order_weight")
def order_counts(build):
    """Of whole maps of relu3_1, at the coarsest zoom."""
    settings = (*ALL_PLACES, "layers=relu1_1,relu3_1", "exemplar_size=256", "target_size=0", "zooms=2")
    none, some = (build(*settings, f"order_weight={weight}") for weight in (0, 5))
    assert [a.ordered for a in none.zooms.values()] == [False, False]
    assert [a.ordered for a in some.zooms.values()] == [True, False]
    views = torch.rand(2, 32, 32, 4, generator=torch.Generator().manual_seed(0))
    values = [t.zooms[128](views, torch.Generator().manual_seed(0)).item() for t in (none, some)]
    assert values[1] > values[0] + 0.1


@check("layers")
def layers_add_up(build):
    losses = [
        _appearance(build(*ALL_PLACES, "colour_weight=0", f"layers={layers}"))
        for layers in ("relu1_1", "relu2_1", "relu1_1,relu2_1")
    ]
    assert losses[0] + losses[1] == pytest.approx(losses[2], rel=1e-3)
    assert min(losses) > 0.01


@check("pooling")
def pooling(build):
    views = torch.rand(2, 32, 32, 4, generator=torch.Generator().manual_seed(0))
    average, largest = (
        _only(build(*ALL_PLACES, f"pooling={pooling}"))(views, torch.Generator().manual_seed(0)).item()
        for pooling in ("average", "max")
    )
    assert average != pytest.approx(largest, rel=1e-3)


@check("samples")
def few_samples_are_random(build):
    """All places give one loss, whichever views they come from; few give another for each choice."""
    views = torch.rand(2, 32, 32, 4, generator=torch.Generator().manual_seed(0))
    for samples, same in ((4096, True), (16, False)):
        loss = _only(build(*ALL_PLACES, f"samples={samples}"))
        values = [loss(views, torch.Generator().manual_seed(seed)).item() for seed in (0, 1)]
        assert (values[0] == pytest.approx(values[1], rel=1e-4)) == same


@check("colour_weight", "moment_weight")
def weights_of_terms(build):
    """The loss is affine in either weight, and not constant."""
    for key in ("colour_weight", "moment_weight"):
        zero, one, three = (_appearance(build(*ALL_PLACES, f"{key}={weight}")) for weight in (0, 1, 3))
        assert three - one == pytest.approx(2 * (one - zero), rel=1e-2)
        assert one > zero + 0.01


@check("colour_histogram")
def histograms_cost_more(build):
    without, with_ = (_appearance(build(*ALL_PLACES, f"colour_histogram={on}")) for on in ("false", "true"))
    assert with_ > without + 0.01


@check("appearance_weight", "overflow_weight")
def weights_of_parts(build):
    one, three = (
        build(*ALL_PLACES, f"appearance_weight={weight}", f"overflow_weight={10 * weight}")
        for weight in (1, 3)
    )
    for task in (one, three):
        task.pool.fill_(2.0)
    (total, parts), (total_3, parts_3) = _loss(one), _loss(three)
    assert parts_3["appearance"] == pytest.approx(3 * parts["appearance"], rel=1e-3)
    assert parts["overflow"] > 0.5
    assert total.item() == pytest.approx(parts["appearance"] + 10 * parts["overflow"], rel=1e-4)
    assert total_3.item() == pytest.approx(parts_3["appearance"] + 30 * parts_3["overflow"], rel=1e-4)


MOVING = ("motion=up", "motion_steps=1", "view_count=1")


def _motion(task, step=1, seed=0):
    """The motion term of one step from a pool of noise; None if there is none."""
    task.pool.copy_(torch.randn(task.pool.shape, generator=torch.Generator().manual_seed(1)))
    return _loss(task, step, seed)[1].get("motion")


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


@pytest.mark.parametrize("key", sorted(CHECKS))
def test_the_check_of_a_key_holds(build, key):
    """The assertions are those of the function above that is registered for the key."""
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
