"""What each step trains, by which losses and at which learning rates, and its preview."""

from collections.abc import Mapping
from functools import partial
from itertools import combinations

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.methods.geometric.config import PRESETS, GeometricConfig
from mitex.methods.geometric.features import displaced, face_features
from mitex.methods.geometric.portrait import portrait
from mitex.methods.geometric.task import learning_rate
from mitex.training import Change
from mitex.training.optim import Adam
from tests.methods.geometric.small import bumpy, small_task

pytestmark = pytest.mark.usefixtures("own_cache")


def test_each_step_trains_the_generator_of_its_level():
    task = small_task()
    generator = torch.Generator().manual_seed(0)
    faces = [len(graph.faces) for graph in task.hierarchy.graphs]
    for step, level in ((0, 0), (2, 0), (3, 1), (8, 2)):
        assert task.cost(step) == 260 + faces[level]
        for parameter in task.parameters:
            parameter.grad = None
        result = task.loss(step, generator)
        result.value.backward()
        assert result.metrics["level"] == level
        for k, network in enumerate(task.generators):
            assert all((p.grad is not None) == (k == level) for p in network.parameters)


def test_the_loss_by_hand():
    """The critic's score of a random mesh, and the distance of the one from the fixed noise (section 3.3)."""
    task = small_task(reconstruction=7.0)
    result = task.loss(0, torch.Generator().manual_seed(1))
    graph, generator = task.hierarchy.graphs[0], torch.Generator().manual_seed(1)
    vertices = []
    for noise in (task.config.noise * torch.randn(task.template.shape, generator=generator), task.fixed):
        offsets = task.generators[0](face_features(task.template + noise, graph), graph)
        vertices.append(displaced(task.template, graph, offsets))
    score = task.critics[0](face_features(vertices[0], graph), graph).mean()
    error = ((vertices[1] - task.meshes[0]) ** 2).mean()
    assert error > 0.01 and score.abs() > 1e-3
    assert torch.allclose(result.value, 7 * error - score, rtol=1e-5)


def metrics_of(change: Change | None) -> Mapping[str, float]:
    return change.metrics if change else {}


def test_critics_take_turns():
    task = small_task(critic_steps=2, generator_steps=3)
    generator = torch.Generator().manual_seed(0)
    trained = ["critic" in metrics_of(task.begin(step, generator)) for step in range(6)]
    assert sum(trained) == 4 and trained[:3] == trained[3:]
    often = small_task(critic_steps=5, generator_steps=1)
    before = often.critics[0].parameters[0].clone()
    often.begin(0, generator)
    assert often.optimizers[0].counts == [5] * len(often.critics[0].parameters)
    assert not torch.equal(before, often.critics[0].parameters[0])


def test_critics_prefer_the_training_mesh():
    """After 40 steps the training mesh has the higher score: more is real, and the generator wants more."""

    def lead(**changes) -> float:
        task = small_task(lr=5e-3, **changes)
        generator = torch.Generator().manual_seed(0)
        task.begin(0, generator)
        adversarial = task.loss(0, generator).metrics["adversarial"]
        graph = task.hierarchy.graphs[0]
        score = task.critics[0](face_features(task.meshes[0], graph), graph).detach().mean()
        return float(score) + adversarial

    assert lead() < 0 and lead(critic_steps=40, generator_steps=1) > 0.05


def test_weights_are_carried_up():
    task = small_task(steps=5, level_steps=1, carried=3)
    generator = torch.Generator().manual_seed(0)
    second = [p.detach().clone() for p in task.generators[2].parameters]
    task.begin(2, generator)
    assert all(torch.equal(p, q) for p, q in zip(task.generators[2].parameters, second, strict=True))
    assert "critic" not in metrics_of(task.begin(3, generator))  # trained, it would be another one
    for networks in (task.generators, task.critics):
        for p, q in zip(networks[3].parameters, networks[2].parameters, strict=True):
            assert torch.equal(p, q)


def test_the_reconstruction_comes_near():
    """Without a critic's pull the generator learns the one mesh from the fixed noise."""
    task = small_task(steps=300, level_steps=300, reconstruction=100.0, lr=5e-3)
    optimizer, generator = Adam(task.parameters), torch.Generator().manual_seed(0)
    errors = []
    for step in range(120):
        optimizer.clear()
        task.begin(step, generator)
        result = task.loss(step, generator)
        result.value.backward()
        optimizer.step(5e-3)
        errors.append(result.metrics["reconstruction"])
    assert np.mean(errors[-10:]) < 0.4 * errors[0]


def test_the_learning_rate_is_halved_on_each_level():
    config = GeometricConfig(steps=30, level_steps=8, lr=1.0)
    rates = [learning_rate(config, step) for step in range(10)]
    assert rates == [1, 1, 0.5, 0.5, 0.25, 0.25, 0.125, 0.125, 1, 1]


@pytest.mark.parametrize(("preset", "quarter"), [("fast", 500), ("paper", 1500)])
def test_the_published_schedule(preset, quarter):
    """From 5e-4, decayed by 0.5 "in intervals of 500 iterations" of the 2,000 on a level: three halvings.

    An iteration has three steps of the generator in `paper`, and one in `fast`.
    """
    config = PRESETS[preset]
    rates = np.array([learning_rate(config, step) for step in range(config.steps)])
    expected = np.repeat([5e-4, 2.5e-4, 1.25e-4, 0.625e-4], quarter)
    np.testing.assert_array_equal(rates.reshape(-1, 4 * quarter), np.tile(expected, (config.levels, 1)))


def test_critics_learn_at_that_rate(monkeypatch):
    rates = []
    monkeypatch.setattr(Adam, "step", lambda self, rate: rates.append(rate))
    task, generator = small_task(steps=8, level_steps=8, critic_steps=1, generator_steps=1), torch.Generator()
    for step in range(8):
        task.begin(step, generator)
    assert rates == [learning_rate(task.config, step) for step in range(8)] and len(set(rates)) == 4


def test_settings():
    assert PRESETS["paper"].levels == 5 and PRESETS["fast"].levels == 5
    assert GeometricConfig(steps=14_000).levels == 7
    with pytest.raises(ConfigError, match="8 levels; set steps to 14000 or less"):
        GeometricConfig(steps=14_001)
    with pytest.raises(ConfigError, match="carried"):
        GeometricConfig(carried=2)  # level 2 has wider networks than level 1


def test_previews(monkeypatch):
    """The reference itself, the training mesh of the level, the reconstruction and two samples."""
    small = partial(portrait, resolution=64, spp=4)
    monkeypatch.setattr("mitex.methods.geometric.task.portrait", small)
    task, reference = small_task(), bumpy()
    tiles = np.split(task.preview(6), 5, axis=1)
    level = task.meshes[1].numpy(), task.hierarchy.meshes[1].faces
    assert np.allclose(tiles[0], small(reference.vertices, reference.faces), atol=0.01)
    assert np.allclose(tiles[1], small(*level), atol=0.01)
    for a, b in combinations(tiles, 2):
        assert np.abs(a - b).mean() > 0.01
