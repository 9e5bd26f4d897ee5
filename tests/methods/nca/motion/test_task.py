"""The training of motion: what it adds to the still one, and the contract of tasks."""

import math

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.losses.motion import motion_loss
from mitex.methods.nca import task as still_training
from mitex.methods.nca.look import Look
from mitex.methods.nca.motion import pool as training
from mitex.methods.nca.motion.start import with_condition
from mitex.methods.nca.motion.task import MotionTask
from mitex.methods.nca.surfaces import TrainingMesh, TrainingPlane
from mitex.methods.nca.task import NcaTask
from mitex.runtime import threads
from tests.methods.nca.tiny import config
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_third_step_leaves_no_trace,
    copies,
)

MOVING = ("motion=right", "motion_steps=2", "surfaces=even,flat")


@pytest.fixture(scope="module")
def exemplar():
    return Exemplar({"albedo": Exemplar.load("lava").maps["albedo"]}, "lava")


@pytest.fixture(autouse=True)
def one_thread():
    threads(1)


def _grown(task):
    generator = torch.Generator().manual_seed(3)
    task.pool.copy_(0.3 * torch.randn(task.pool.shape, generator=generator))
    for index in range(len(task.pool)):  # rows beyond the cells stay zero
        task.pool[index, task.surface(index).perception.vertices :] = 0
    return task


def _smooth(task):
    """The same, with states that differ little from cell to cell."""
    for index, state in enumerate(task.pool):
        surface, scale = task.surface(index), 3.0
        mesh = surface.mesh if isinstance(surface, TrainingMesh) else surface.lattice.mesh
        if isinstance(surface, TrainingPlane):
            scale = 2 * math.pi / surface.lattice.columns
        waves = np.sin(scale * mesh.vertices[: surface.perception.vertices].astype(np.float64)).round(9)
        state[: len(waves)] = torch.from_numpy(0.3 * waves[:, np.arange(16) % 3]).float()
    return task


def _metrics(task, step=1, seed=0):
    return task.loss(step, torch.Generator().manual_seed(seed)).metrics


@pytest.mark.parametrize("step", [0, 1])
@pytest.mark.parametrize("surface", ["even", "flat"])
def test_the_loss_changes_nothing(exemplar, step, surface):
    task = _grown(MotionTask(config(*MOVING, f"surfaces={surface}"), exemplar))
    assert_loss_is_pure(task, step)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_skipped_step_leaves_every_byte(exemplar, fault):
    settings = config(*MOVING)
    assert_third_step_leaves_no_trace(lambda: _grown(MotionTask(settings, exemplar)), settings, fault)


def test_motion_is_one_more_term(exemplar):
    """Weighted, of states that show something, from some step on."""
    one, three, late = (
        _grown(MotionTask(config(*MOVING, "inject_every=3", *more), exemplar))
        for more in (("motion_weight=1",), ("motion_weight=3",), ("motion_start=5",))
    )
    metrics = _metrics(one)
    assert metrics["motion"] > 0
    assert _metrics(three)["motion"] == pytest.approx(3 * metrics["motion"], rel=1e-5)
    assert "motion" not in _metrics(one, step=3)  # the seed
    assert "motion" not in _metrics(late, step=4) and "motion" in _metrics(late, step=5)
    total = one.loss(1, torch.Generator().manual_seed(0)).value
    terms = metrics["appearance"] + 100 * metrics["overflow"] + metrics["motion"]
    assert total.item() == pytest.approx(terms, rel=1e-5)


def test_a_perfect_transport_would_cost_nothing(exemplar, monkeypatch):
    """Where each of the states is the one before, carried along; also the field that the cells were told. A
    decoder with grain, which stays in place, never is perfect.
    """
    settings = (*MOVING, "min_steps=7", "max_steps=7", "motion_period=4", "motion_weight=1")
    settings += ("motion_advection=false",)
    task, grainy = (
        _smooth(MotionTask(config(*settings, f"coordinates={words}"), exemplar)) for words in ("", "waves")
    )
    monkeypatch.setattr(training, "FLOOR", 0.0)
    fields = []

    def draw(*arguments):
        fields.append(training.TangentField(*drawn(*arguments)))
        return fields[-1]

    drawn = lambda *arguments: vars(original(*arguments)).values()  # noqa: E731
    original = training.random_field
    monkeypatch.setattr(training, "random_field", draw)

    def evolve(state, operator, steps, generator, condition, advection):
        assert advection is None
        assert torch.equal(condition, fields[-1].condition)
        return fields[-1].advection(steps / 4)(state[0])[None]

    for one in (task, grainy):
        monkeypatch.setattr(one.look.rule, "evolve", evolve)
    assert _metrics(task)["motion"] < 0.1 < _metrics(grainy)["motion"]
    monkeypatch.setattr(task.look.rule, "evolve", lambda state, *_: state)
    assert _metrics(task)["motion"] == pytest.approx(2)  # of the states, and of what they show


def test_estimators_of_pictures_see_the_last_states(exemplar, monkeypatch):
    """And are compared with what the field would show; their loss is that of motions in pictures."""

    def estimator(first, second):
        assert first.shape == second.shape == (4, 1, 32, 32) and second.requires_grad
        return (second - first).expand(-1, 2, -1, -1)

    monkeypatch.setattr(training, "load_estimator", lambda name, device: {"lucas-kanade": estimator}[name])
    for surface in ("even", "flat"):
        settings = (*MOVING, f"surfaces={surface}", "motion_estimator=lucas-kanade", "density=8")
        task = _grown(MotionTask(config(*settings), exemplar))
        result = task.loss(1, torch.Generator().manual_seed(0))
        result.value.backward()
        gradient = task.look.rule.fc1.weight.grad
        assert result.metrics["motion"] > 0
        assert gradient is not None and gradient[:, -3:].any()


def test_the_loss_of_pictures_compares_what_it_should(exemplar, monkeypatch):
    """The last two states, no farther apart than estimators see, where the sphere is, in the settings' units;
    of views that show its rim, too.
    """
    pictures, states, views, compared = [], [], [], []

    def estimator(first, second):
        pictures.extend((first, second))
        return (second - first).expand(-1, 2, -1, -1)

    def loss(flow, target, mask=None, **options):
        compared.append((flow, target, mask, options))
        return motion_loss(flow, target, mask, **options)

    monkeypatch.setattr(training, "load_estimator", lambda name, device: estimator)
    monkeypatch.setattr(training, "motion_loss", loss)
    settings = (*MOVING, "surfaces=even", "views=full", "motion_steps=50", "min_steps=50", "max_steps=50")
    settings += ("motion_estimator=lucas-kanade", "motion_period=40", "motion_gamma=0.7", "motion_speeds=2,2")
    task = _grown(MotionTask(config(*settings, "motion_weight=3", "resolution=96"), exemplar))
    evolve, motion_views = task.look.rule.evolve, task.motion_views

    def evolved(state, operator, steps, *arguments):
        states.append((steps, evolve(state, operator, steps, *arguments)))
        return states[-1][1]

    def seen(*arguments):
        views.append(motion_views(*arguments))
        return views[-1]

    monkeypatch.setattr(task.look.rule, "evolve", evolved)
    monkeypatch.setattr(task, "motion_views", seen)
    metrics = _metrics(task)
    ((flow, target, mask, options),), (view,) = compared, views
    ways = view.target.norm(dim=1)
    apart = int(4 * 40 / float(ways[view.mask].max()))
    assert 2 <= apart <= 25 and [steps for steps, _ in states] == [50 % apart] + 50 // apart * [apart]
    for picture, (_, state) in zip(pictures, states[-2:], strict=True):
        assert torch.equal(picture, view.grey(state[0]))
    assert torch.equal(flow, (pictures[1] - pictures[0]).expand(-1, 2, -1, -1))
    assert torch.equal(target, view.target) and mask is not None and torch.equal(mask, view.mask)
    assert 0 < mask.float().mean() < 1 and pictures[1].requires_grad
    assert options == {"steps": apart, "period": 40.0, "gamma": 0.7}
    expected = motion_loss(flow, target, mask, steps=apart, period=40.0, gamma=0.7).total
    assert metrics["motion"] == pytest.approx(3 * expected.item(), rel=1e-5)


@pytest.mark.parametrize("surface", ["even", "flat"])
def test_motion_is_measured_in_the_widest_of_the_views(exemplar, monkeypatch, surface):
    """In which it is the fewest pixels."""
    words = (*MOVING, f"surfaces={surface}", "motion_estimator=lucas-kanade", "zooms=2", "exemplar_size=256")
    task, sizes = MotionTask(config(*words, "density=4"), exemplar), []
    closeups = task.closeups
    monkeypatch.setattr(task, "closeups", lambda size, *least: sizes.append(size) or closeups(size, *least))
    task.motion_views(task.field(0, task.field_seeds[0]), torch.Generator().manual_seed(0))
    assert sizes == [128] and list(task.zooms) == [128, 256]


def test_a_floor_keeps_the_residual_of_what_stands_still_small(exemplar, monkeypatch):
    """A tenth of the variance of the states."""
    task = MotionTask(config(*MOVING, "surfaces=even"), exemplar)
    sphere, generator = task.surface(0), torch.Generator().manual_seed(1)
    before, after = torch.randn(2, sphere.perception.vertices, 16, generator=generator)
    monkeypatch.setattr(task, "_decoded_residual", lambda *_: torch.zeros(()))
    field = training.TangentField(sphere, np.zeros((len(before), 3)))
    residual = task.state_residual([before, after], field, 2, generator)
    expected = (after - before).square().sum() / (0.1 * (before - before.mean(0)).square().sum())
    assert float(residual) == pytest.approx(float(expected), rel=1e-3)


@pytest.mark.parametrize(
    ("surface", "density", "resolution"), [("even", 512, 48), ("flat", 32, 96)], ids=["even", "flat"]
)
def test_patterns_wider_than_the_surface_are_measured(exemplar, surface, density, resolution):
    """Views show less of them then, in fewer pixels, but in as many as Lucas and Kanade's method needs."""
    wide = (f"surfaces={surface}", f"density={density}", f"resolution={resolution}")
    task = _grown(MotionTask(config(*MOVING, *wide, "motion_estimator=lucas-kanade"), exemplar))
    assert 0 < _metrics(task)["motion"] < math.inf


def test_cells_may_know_nothing_of_the_field(exemplar):
    """The paper's ablation: the same loss, but no condition."""
    task = _grown(MotionTask(config(*MOVING, "motion_encoding=false"), exemplar))
    assert task.look.rule.condition == 0 and _metrics(task)["motion"] > 0


def test_a_still_look_begins_as_it_was(exemplar):
    """Bit for bit, whatever the cells are told; the weights of that have gradients."""
    still = NcaTask(config(), exemplar).look
    look = with_condition(still)
    assert isinstance(look, Look) and look.rule.condition == 3 and still.rule.condition == 0
    sphere = MotionTask(config(*MOVING), exemplar, look).surfaces[0]
    state = 0.3 * torch.randn(1, sphere.perception.vertices, 16, generator=torch.Generator().manual_seed(0))
    told = torch.randn(sphere.perception.vertices, 3, generator=torch.Generator().manual_seed(1))
    ours = look.rule.evolve(state, sphere.perception, 6, torch.Generator().manual_seed(2), told)
    theirs = still.rule.evolve(state, sphere.perception, 6, torch.Generator().manual_seed(2))
    assert torch.equal(ours, theirs)
    ours.square().sum().backward()
    assert look.rule.fc1.weight.grad is not None and look.rule.fc1.weight.grad[:, -3:].any()


@pytest.mark.parametrize("encoding", ["true", "false"])
def test_previews_are_of_moving_states(exemplar, monkeypatch, encoding):
    """They leave the pool alone, and are the same again."""
    monkeypatch.setattr(still_training, "PREVIEW", 48)
    task = _grown(MotionTask(config(*MOVING, f"motion_encoding={encoding}"), exemplar))
    before = task.pool.clone()
    picture = task.preview(5)
    assert picture.shape == (48, 4 * 48, 3) and np.array_equal(task.preview(5), picture)
    assert torch.equal(task.pool, before)


def test_a_state_keeps_its_way_until_the_seed_replaces_it(exemplar):
    """Of direction and speed; `commit` alone writes it down, and checkpoints have it."""
    task = MotionTask(config(*MOVING, "pool=1", "inject_every=4"), exemplar)
    seeds, fields = [], []
    for step in range(1, 9):
        before = task.field_seeds.clone()
        result = task.loss(step, torch.Generator().manual_seed(step))
        assert torch.equal(task.field_seeds, before)
        result.commit()
        seeds.append(int(task.field_seeds[0]))
        fields.append(task.field(0, task.field_seeds[0]).vectors)
    assert len(set(seeds[:3])) == len(set(seeds[3:7])) == 1 and len(set(seeds)) == 3
    assert np.array_equal(fields[0], fields[2]) and np.abs(fields[2] - fields[3]).max() > 0.1
    other = MotionTask(config(*MOVING, "pool=1"), exemplar)
    other.load_state(copies(task.state()))
    assert torch.equal(other.field_seeds, task.field_seeds)
