"""The training task: pool, randomness, views, state, and bit-identical resumption."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError
from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods.nca import task as training
from mitex.methods.nca.config import DEFAULT
from mitex.methods.nca.surfaces import TrainingMesh
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


def _spheres(task) -> list[TrainingMesh]:
    return [surface for surface in task.surfaces if isinstance(surface, TrainingMesh)]


def _fresh(task):
    task.pool.zero_()
    task._touched.zero_()


def _grow(task, state, steps, generator):
    with torch.no_grad():
        return task.look.rule.evolve(state, task.surfaces[0].perception, steps, generator)


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


def test_states_grow_on_both_spheres_in_turns(exemplar):
    """Even ones of the pool on the icosphere, the others on scattered vertices."""
    task = NcaTask(config("surfaces=even,uneven"), exemplar)
    even, uneven = _spheres(task)
    assert np.array_equal(even.mesh.vertices, icosphere(8).vertices)
    assert len(uneven.mesh.vertices) == 642 and uneven.mesh.edges.indptr[-1] == even.mesh.edges.indptr[-1]
    assert [task.surface(k) for k in range(4)] == [even, uneven, even, uneven]
    torch.nn.init.normal_(task.pool, std=0.1, generator=torch.Generator().manual_seed(9))
    before, grown = task.pool.clone(), set()
    for seed in range(8):
        task.pool.copy_(before)
        task.loss(1, torch.Generator().manual_seed(seed)).commit()
        generator = torch.Generator().manual_seed(seed)
        index = int(torch.randint(4, (), generator=generator))
        steps = int(torch.randint(2, 5, (), generator=generator))
        with torch.no_grad():
            operator = task.surfaces[index % 2].perception
            expected = task.look.rule.evolve(before[index][None], operator, steps, generator)[0]
        assert torch.equal(task.pool[index], expected)
        grown.add(index % 2)
    assert grown == {0, 1}


def test_a_step_moves_the_bounds(exemplar):
    """When it is committed, towards the smallest and largest values of the state."""
    task = NcaTask(config(), exemplar)
    result = task.loss(1, torch.Generator().manual_seed(4))
    assert (task.look.low == -1).all() and (task.look.high == 1).all()
    result.commit()
    state = task.pool[task._touched][0]
    assert torch.allclose(task.look.low, -0.98 + 0.02 * state.amin(0), atol=1e-6)
    assert torch.allclose(task.look.high, 0.98 + 0.02 * state.amax(0), atol=1e-6)


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
    assert result.value.item() == pytest.approx(parts["appearance"] + 100 * parts["overflow"], rel=1e-6)
    result.value.backward()
    assert all(p.grad is not None and p.grad.any() for p in task.parameters)


def test_loss_is_the_mean_over_the_zooms(exemplar):
    """At 128, 256 and 512 pixels; each has views of its own, from the coarsest on."""
    settings = ("exemplar_size=512", "target_size=0", "zooms=3", "resolution=16", "view_count=1")
    task = NcaTask(config(*settings, "layers=relu1_1"), exemplar)
    assert list(task.zooms) == [128, 256, 512]
    zooms: Any = {size: lambda views, _, k=k: 10.0**k * views.mean() for k, size in enumerate(task.zooms)}
    task.zooms = zooms
    total = task.loss(1, torch.Generator().manual_seed(0)).metrics["appearance"]
    generator = torch.Generator().manual_seed(0)
    torch.randint(4, (), generator=generator)
    steps = int(torch.randint(2, 5, (), generator=generator))
    (sphere,), state = _spheres(task), _grow(task, torch.zeros(1, 642, 16), steps, generator)[0]
    means = []
    for size in (128, 256, 512):
        cameras = task.cameras(sphere, size, generator)
        means.append(sphere.views(task.look, state, cameras).mean().item())
    assert total == pytest.approx((means[0] + 10 * means[1] + 100 * means[2]) / 3, rel=1e-4)


def test_zooms_that_would_be_too_small_are_left_out(exemplar):
    settings = ("target_size=0", "zooms=3", "layers=relu1_1")
    sizes = [
        list(NcaTask(config(f"exemplar_size={size}", *settings), exemplar).zooms) for size in (32, 200, 256)
    ]
    assert sizes == [[32], [200], [128, 256]]


@pytest.mark.parametrize(("side", "sizes"), [(128, 1), (256, 2), (600, 3), (1024, 4)])
def test_exemplars_of_1024_pixels_are_seen_at_their_own_size_by_default(exemplar, side, sizes):
    """The finest views have all of an exemplar's pixels, and the coarsest 128 or a bit more."""
    default = {key: getattr(DEFAULT, key) for key in ("exemplar_size", "zooms", "target_size")}
    height = exemplar.maps["height"]
    enlarged = Exemplar({"height": np.repeat(np.repeat(height, 2, 0), 2, 1)}).resized(side)
    assert list(NcaTask(replace(config("layers=relu1_1"), **default), enlarged).zooms) == [
        side >> halvings for halvings in reversed(range(sizes))
    ]


def test_parameters_are_those_of_rule_and_decoder(task):
    """The decoder reads 16 channels and 8 waves, and gives an albedo and a height."""
    shapes = [tuple(p.shape) for p in task.parameters]
    assert shapes[:4] == [(16, 80), (16,), (16, 16), (16,)]
    assert shapes[4:] == [(12, 24), (12,), (12, 12), (12,), (12, 12), (12,), (4, 12), (4,)]


def test_weights_follow_the_seed(exemplar):
    one, again, other = (NcaTask(config(f"seed={seed}"), exemplar).parameters for seed in (0, 0, 1))
    assert all(torch.equal(a, b) for a, b in zip(one, again, strict=True))
    different = [not torch.equal(a, b) for a, b in zip(one, other, strict=True) if a.any()]
    assert len(different) == 11 and all(different)  # all but the bias of the rule's last layer


def test_training_can_start_from_a_look(exemplar, task):
    started = NcaTask(config("seed=5"), exemplar, task.look)
    pairs = list(zip(started.parameters, task.parameters, strict=True))
    assert all(torch.equal(a, b) for a, b in pairs) and all(a is not b for a, b in pairs)


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


def _cameras(task, size=32):
    return task.cameras(task.surfaces[0], size, torch.Generator().manual_seed(0))


def test_patches_have_the_wanted_density(task):
    """`density` vertices fit along the width of the exemplar, measured on the mesh's own edges."""
    mesh = task.surfaces[0].mesh
    edges = np.linalg.norm(mesh.vertices[mesh.edges.indices] - mesh.vertices[mesh.edges.rows], axis=1)
    cameras = _cameras(task)
    assert (cameras.kind, cameras.shape) == ("orthographic", (4, 32, 32))
    assert cameras.half_width == pytest.approx(8 * edges.mean() / 2, rel=0.03)


def test_a_larger_exemplar_is_seen_closer(task):
    """A pixel of a view is always a pixel of the exemplar; no patch is wider than the sphere shows."""
    assert _cameras(task, 64).half_width == pytest.approx(_cameras(task).half_width / 2)
    widest = _cameras(task, 16)
    assert widest.half_width == pytest.approx(0.65)
    pixel = 2 * _cameras(task, 32).half_width / 32
    assert 2 * widest.half_width / widest.width == pytest.approx(2 * pixel, rel=0.03)
    assert widest.width == widest.height < 32


@pytest.mark.parametrize("size", [8, 32, 64])
@pytest.mark.parametrize("kind", ["even", "uneven"])
def test_every_pixel_of_a_patch_is_surface(exemplar, kind, size):
    """Also of the widest patches."""
    (sphere,) = _spheres(NcaTask(config(f"surfaces={kind}"), exemplar))
    task = NcaTask(config("view_count=30"), exemplar)
    cameras = task.cameras(sphere, size, torch.Generator().manual_seed(0))
    assert (sphere.stage.visibility(cameras).coverage == 1).all()


def test_full_views(exemplar):
    task = NcaTask(config("views=full", "distance=3", "fov=45"), exemplar)
    cameras = _cameras(task)
    assert (cameras.kind, cameras.shape) == ("perspective", (4, 32, 32))
    assert cameras.fov == 45
    assert np.allclose(np.linalg.norm(cameras.origin, axis=1), 3, atol=1e-5)
    assert task.loss(0, torch.Generator().manual_seed(0)).value.isfinite()


def test_preview_shows_a_row_for_each_map(task, monkeypatch):
    """The exemplar, a patch, a closer one, the sphere."""
    monkeypatch.setattr(training, "PREVIEW", 48)
    _fresh(task)
    before = task.pool.clone()
    picture = task.preview(5)
    assert picture.shape == (2 * 48, 4 * 48, 3)
    assert picture.min() >= 0 and picture.max() <= 1
    for row, name in enumerate(MAPS):
        expected = np.clip(task.exemplar.resized(48).maps[name], 0, 1)
        assert np.allclose(picture[48 * row : 48 * row + 48, :48], expected, atol=1e-6)
    assert np.ptp(picture[48:], axis=2).max() == 0  # the height in grey
    wide, close = picture[:48, 48:96], picture[:48, 96:144]
    assert np.abs(np.diff(wide, axis=1)).mean() > 1.2 * np.abs(np.diff(close, axis=1)).mean()
    assert not picture[:4, -48:-44].any() and picture[20:28, -28:-20].all()  # around the sphere and on it
    assert torch.equal(task.pool, before)
    assert np.array_equal(task.preview(5), picture)


def test_preview_of_an_exemplar_that_the_sphere_is_too_small_for(exemplar, monkeypatch):
    """Its patch shows less, at its scale, with a margin."""
    monkeypatch.setattr(training, "PREVIEW", 48)
    task = NcaTask(config("density=24"), exemplar)
    picture = task.preview(5)
    assert picture.shape == (2 * 48, 4 * 48, 3)
    assert not picture[:4, 48:96].any() and picture[20:28, 68:76].any()


def test_metadata(task):
    key = task.exemplar.key
    exemplar = {"exemplar": "scales", "exemplar_key": key}
    assert task.metadata() == {"method": "nca", "maps": "albedo,height"} | exemplar
    maps = {name: values.copy() for name, values in task.exemplar.maps.items()}
    assert Exemplar(maps, "of another name").key == key
    maps["height"][0, 0] = 1 - maps["height"][0, 0]
    assert Exemplar(maps, "scales").key != key


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
    smallest = ("resolution=16", "exemplar_size=16", "target_size=16", "layers=relu1_1,relu5_3", "zooms=6")
    loss = NcaTask(config(*smallest), exemplar).loss(0, torch.Generator().manual_seed(0)).value
    loss.backward()
    assert loss.isfinite()
