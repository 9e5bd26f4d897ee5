"""The training task: pool, randomness, views, state, and bit-identical resumption."""

import json

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError
from mitex.exemplar import Exemplar
from mitex.methods.nca.task import NcaTask
from mitex.runtime import threads
from mitex.training import train
from tests.methods.nca.tiny import config
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

MAPS = ("albedo", "height")


@pytest.fixture(scope="module")
def exemplar():
    maps = Exemplar.load("scales").maps
    return Exemplar({name: maps[name] for name in MAPS}, "scales")


@pytest.fixture(scope="module")
def task(exemplar):
    return NcaTask(config(), exemplar)


def _fresh(task):
    task.pool.zero_()
    task._touched.zero_()


def _grow(task, state, steps, generator):
    with torch.no_grad():
        return task.model.evolve(state, task.perception, steps, generator)


def test_a_step_evolves_a_state_of_the_pool(task):
    """Index, number of steps and masks in this order from the generator; written back by `commit` only."""
    _fresh(task)
    torch.nn.init.normal_(task.pool, std=0.1, generator=torch.Generator().manual_seed(9))
    before = task.pool.clone()
    result = task.loss(1, torch.Generator().manual_seed(4))
    assert torch.equal(task.pool, before)
    result.commit()
    generator = torch.Generator().manual_seed(4)
    index = int(torch.randint(4, (), generator=generator))
    steps = int(torch.randint(2, 5, (), generator=generator))
    assert torch.equal(task.pool[index], _grow(task, before[index][None], steps, generator)[0])
    others = [k for k in range(4) if k != index]
    assert torch.equal(task.pool[others], before[others])


def test_the_seed_is_injected(task):
    _fresh(task)
    task.pool.fill_(0.3)
    task.loss(3, torch.Generator().manual_seed(4)).commit()  # every third step
    generator = torch.Generator().manual_seed(4)
    index = int(torch.randint(4, (), generator=generator))
    steps = int(torch.randint(2, 5, (), generator=generator))
    assert torch.equal(task.pool[index], _grow(task, torch.zeros(1, 642, 16), steps, generator)[0])


def test_loss_is_appearance_and_overflow(task):
    _fresh(task)
    task.pool.fill_(2.0)
    result = task.loss(1, torch.Generator().manual_seed(0))
    parts = result.metrics
    assert parts["overflow"] > 0.5
    assert result.value.item() == pytest.approx(parts["appearance"] + 1e4 * parts["overflow"], rel=1e-6)
    result.value.backward()
    assert all(p.grad is not None and p.grad.any() for p in task.parameters)


def test_parameters_are_those_of_the_model(task):
    assert [p.shape for p in task.parameters] == [(16, 80), (16,), (16, 16), (16,)]


def test_weights_follow_the_seed(exemplar):
    one, other = (NcaTask(config(f"seed={seed}"), exemplar).model for seed in (0, 1))
    assert not torch.equal(one.fc1.weight, other.fc1.weight)


def test_training_can_start_from_a_model(exemplar, task):
    started = NcaTask(config("seed=5"), exemplar, task.model)
    assert torch.equal(started.model.fc1.weight, task.model.fc1.weight)
    assert started.model is not task.model


def test_state_round_trip(exemplar, task):
    _fresh(task)
    generator = torch.Generator().manual_seed(1)
    for step in range(2):
        task.loss(step, generator).commit()
    saved = {name: value.clone() for name, value in task.state().items()}
    other = NcaTask(config("seed=8"), exemplar)
    other.pool.fill_(0.2)  # what the checkpoint does not hold was the seed
    other.load_state({name: value.clone() for name, value in saved.items()})
    assert torch.equal(other.pool, task.pool)
    assert all(torch.equal(a, b) for a, b in zip(other.parameters, task.parameters, strict=True))
    assert other.state().keys() == saved.keys()
    assert all(torch.equal(value, saved[name]) for name, value in other.state().items())


def test_a_fresh_pool_takes_no_room(exemplar):
    assert NcaTask(config(), exemplar).state()["pool.states"].shape == (0, 642, 16)


def test_patches_have_the_wanted_density(task):
    """`density` vertices fit along the width of the exemplar, measured on the mesh's own edges."""
    graph, points = task.mesh.edges, task.mesh.vertices
    edges = np.linalg.norm(points[graph.indices] - points[graph.rows], axis=1)
    pixels = 32  # of the exemplar
    assert pixels * task.pixel == pytest.approx(8 * edges.mean(), rel=0.03)
    cameras = task.cameras(torch.Generator().manual_seed(0))
    assert (cameras.kind, cameras.shape) == ("orthographic", (4, 32, 32))
    assert cameras.half_width == pytest.approx(16 * task.pixel)


def test_every_pixel_of_a_patch_is_surface(task):
    views = task.stage.visibility(task.cameras(torch.Generator().manual_seed(0)))
    assert (views.coverage == 1).all()


def test_full_views(exemplar):
    task = NcaTask(config("views=full", "distance=3", "fov=45"), exemplar)
    cameras = task.cameras(torch.Generator().manual_seed(0))
    assert (cameras.kind, cameras.shape) == ("perspective", (4, 32, 32))
    assert cameras.fov == pytest.approx(np.radians(45))
    assert np.allclose(np.linalg.norm(cameras.origin, axis=1), 3, atol=1e-5)
    assert task.loss(0, torch.Generator().manual_seed(0)).value.isfinite()


def test_preview_shows_a_row_for_each_map(task):
    _fresh(task)
    before = task.pool.clone()
    picture = task.preview(5)
    assert picture.shape == (2 * 64, 32 + 32 + 64, 3)
    assert picture.min() >= 0 and picture.max() <= 1
    albedo = task.exemplar.resized(32).maps["albedo"]
    assert np.allclose(picture[:32, :32], albedo) and np.allclose(picture[32:64, :32], albedo)
    assert np.ptp(picture[64:, :32], axis=2).max() == 0  # the height in grey
    assert torch.equal(task.pool, before)
    assert np.array_equal(task.preview(5), picture)


def test_metadata(task):
    assert task.metadata() == {"method": "nca", "maps": "albedo,height", "exemplar": "scales"}


def _run(exemplar, folder, steps, resume=False):
    settings = config(f"steps={steps}", "checkpoint_every=2", "preview_every=0")
    task = NcaTask(settings, exemplar)
    train(
        task,
        settings,
        folder,
        lr=settings.lr,
        normalise_gradients=True,
        resume=resume,
        quiet=True,
    )
    return task


def test_a_resumed_training_is_the_same_training(tmp_path, exemplar):
    threads(1)
    whole = _run(exemplar, tmp_path / "whole", 6)
    _run(exemplar, tmp_path / "parts", 3)
    parts = _run(exemplar, tmp_path / "parts", 6, resume=True)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "parts")
    assert torch.equal(whole.pool, parts.pool) and whole.pool.any()
    losses = []
    for name in ("whole", "parts"):
        lines = (tmp_path / name / "metrics.jsonl").read_text().splitlines()
        losses.append([json.loads(line)["loss"] for line in lines])
    assert len(losses[0]) == 6 and losses[0] == losses[1]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_skipped_step_leaves_every_byte(exemplar, fault):
    threads(1)
    assert_third_step_leaves_no_trace(lambda: NcaTask(config(), exemplar), config(), fault)


@pytest.mark.parametrize("step", [0, 1])
def test_the_loss_changes_nothing(exemplar, step):
    threads(1)
    task = NcaTask(config(), exemplar)
    task.pool.fill_(0.1)
    assert_loss_is_pure(task, step)
    assert (task.pool == 0.1).all()


def test_resuming_with_another_exemplar_is_refused(tmp_path, exemplar):
    _run(exemplar, tmp_path / "run", 1)
    with pytest.raises(CheckpointError, match="exemplar"):
        _run(Exemplar(exemplar.maps, "lava"), tmp_path / "run", 2, resume=True)


def test_the_smallest_sizes_train(exemplar):
    """16 pixels are one place of relu5_3, where a covariance of one vector is zero."""
    smallest = ("resolution=16", "exemplar_size=16", "target_size=16", "layers=relu1_1,relu5_3")
    loss = NcaTask(config(*smallest), exemplar).loss(0, torch.Generator().manual_seed(0)).value
    loss.backward()
    assert loss.isfinite()
