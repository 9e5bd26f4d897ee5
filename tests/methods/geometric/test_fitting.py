"""A small real training, its model, and growing it on other meshes."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from itertools import combinations
from unittest.mock import patch

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError, MeshError
from mitex.mesh import Mesh, grid, icosphere, subdivide_midpoint, torus
from mitex.mesh.topology import boundary_edges
from mitex.methods import geometric
from mitex.methods.geometric import METHOD
from mitex.methods.geometric.config import PRESETS, GeometricConfig
from mitex.methods.geometric.features import displaced, face_features
from mitex.methods.geometric.gan import critic_loss
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.network import FaceNetwork
from mitex.methods.geometric.portrait import portrait
from mitex.methods.geometric.references import find_reference
from mitex.methods.geometric.report import report
from mitex.methods.geometric.task import GeometricTask, learning_rate
from mitex.methods.geometric.template import normalised, topology
from mitex.methods.geometric.texture import GeometricTexture, slerp
from mitex.methods.registry import method_of
from mitex.runtime import threads
from mitex.training import Change, checkpoint, train
from mitex.training.locate import NAME
from mitex.training.optim import Adam
from mitex.training.state import TrainState
from tests.shapes import collapsed, fan, moebius, pair, turned
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_same_state,
    assert_third_step_leaves_no_trace,
    spoiled,
    with_nan_gradients,
)

pytestmark = pytest.mark.usefixtures("own_cache")
SMALL = [
    "steps=9",
    "level_steps=3",
    "fit_steps=40",
    "fit_samples=300",
    "checkpoint_every=4",
    "preview_every=0",
]


def bumpy() -> Mesh:
    ball = icosphere(12)
    height = 1 + 0.15 * np.sin(7 * ball.vertices).prod(1, keepdims=True)
    return replace(ball.with_vertices(ball.vertices * height), name="bumpy")


def hill() -> Mesh:
    flat = grid(16, 16)
    x, y, _ = flat.vertices.T
    return replace(flat.with_vertices(np.stack([x, y, 0.2 * np.cos(2 * x) * np.cos(2 * y)], 1)), name="hill")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "bumpy"
    return folder, geometric.fit(bumpy(), folder, set=SMALL)


def small_task(**changes) -> GeometricTask:
    config = replace(GeometricConfig(steps=9, level_steps=3), **changes)
    ball = icosphere(1)
    hierarchy = Hierarchy.of(ball, config.levels)
    generator = torch.Generator().manual_seed(4)
    meshes = [
        torch.tensor(mesh.vertices) * 2**k + 0.1 * torch.randn(len(mesh.vertices), 3, generator=generator)
        for k, mesh in enumerate(hierarchy.meshes)
    ]
    return GeometricTask(config, hierarchy, torch.tensor(ball.vertices), meshes, bumpy())


def test_the_run_folder(run):
    folder, texture = run
    assert {p.name for p in folder.iterdir()} >= {"config.toml", "metrics.jsonl", checkpoint.NAME, NAME}
    assert method_of(folder) == method_of(folder / NAME) == METHOD
    assert texture.levels == 3 and texture.about["steps"] == 9
    assert [level["faces"] for level in texture.about["fit"]] == [20, 80, 320]


def test_models_round_trip(run):
    folder, texture = run
    again = GeometricTexture.load(folder)
    assert dict(again.about) == dict(texture.about)
    mesh = icosphere(4)
    for seed in (0, 1):
        a, b = (t.apply(mesh, seed=seed).mesh.vertices for t in (texture, again))
        assert np.array_equal(a, b)


@pytest.mark.parametrize("damage", ["cut", "foreign", "nan", "noise", "shape", "missing"])
def test_what_is_no_model_is_refused(run, tmp_path, damage):
    from safetensors.torch import load_file, save_file

    source = run[0] / NAME
    path = tmp_path / NAME
    if damage == "cut":
        path.write_bytes(source.read_bytes()[:-100])
    elif damage == "foreign":
        save_file({"x": torch.zeros(3)}, path)
    elif damage == "nan":
        texture = GeometricTexture.load(source)
        with torch.no_grad():
            texture.generators[0].parameters[0][0, 0] = torch.nan
        texture.save(path)
        assert load_file(path)
    elif damage == "noise":
        texture = GeometricTexture.load(source)
        replace(texture, fixed=texture.fixed[1:]).save(path)
    elif damage == "shape":
        texture = GeometricTexture.load(source)
        texture.generators[0].parameters[0] = texture.generators[0].parameters[0][:1, :1]
        texture.save(path)
    message = "there is no model in" if damage == "missing" else "geometric texture"
    with pytest.raises(CheckpointError, match=message):
        GeometricTexture.load(tmp_path)


def test_the_mesh_is_split_on_every_level_but_the_first(run):
    mesh = torus(12, 6)
    for start, end, splits in ((0, 2, 2), (1, 2, 1), (2, 2, 0), (0, 0, 0), (None, None, 0)):
        asset = run[1].apply(mesh, start_level=start, end_level=end)
        assert len(asset.mesh.faces) == 4**splits * len(mesh.faces)
        assert np.array_equal(asset.mesh.faces, subdivide_midpoint(mesh, splits).faces)


def test_results_keep_place_and_size(run):
    """Scaling and moving the mesh scales and moves the result; the noise decides the rest."""
    mesh = icosphere(6)
    a = run[1].apply(mesh, seed=3).mesh.vertices
    b = run[1].apply(mesh.with_vertices(5 * mesh.vertices + [1, 2, 3]), seed=3).mesh.vertices
    assert np.allclose(5 * a + [1, 2, 3], b, atol=2e-3)
    assert not np.allclose(a, run[1].apply(mesh, seed=4).mesh.vertices, atol=1e-4)


def test_uvs_are_interpolated(run):
    mesh = grid(6, 6)
    asset = run[1].apply(mesh, start_level=1)
    expected = subdivide_midpoint(mesh).uv
    assert asset.mesh.uv is not None and expected is not None and np.array_equal(asset.mesh.uv, expected)


UNSOUND = [grid(5, 4), moebius(), fan(), turned(icosphere(3)), collapsed(icosphere(3)), pair(icosphere(3))]


@pytest.mark.parametrize("mesh", [torus(8, 4), *UNSOUND], ids=lambda mesh: mesh.name)
def test_open_and_unsound_meshes_are_displaced(run, mesh):
    """But for their borders."""
    moved = run[1].apply(mesh, start_level=1).mesh
    assert np.isfinite(moved.vertices).all()
    far = np.linalg.norm(moved.vertices - subdivide_midpoint(mesh).vertices, axis=1)
    inner = np.ones(len(far), bool)
    inner[boundary_edges(moved.faces, len(far))] = False
    assert (far[inner] > 1e-3).mean() > 0.9 and far.max() < 2 * np.ptp(mesh.vertices, axis=0).max()
    assert far[~inner].max(initial=0.0) < 1e-6


def test_faces_that_name_a_vertex_twice_are_refused(run, tmp_path):
    ball = bumpy()
    mesh = replace(ball, faces=np.concatenate([ball.faces, [[0, 0, 1]]]))
    with pytest.raises(MeshError, match="bumpy has faces that name a vertex twice: 1"):
        run[1].apply(mesh)
    with pytest.raises(MeshError, match="bumpy has faces that name a vertex twice: 1"):
        geometric.fit(mesh, tmp_path / "run", set=SMALL)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("mesh", [moebius(), fan(), turned(bumpy())], ids=lambda mesh: mesh.name)
def test_references_without_two_sides_are_refused(tmp_path, mesh):
    with pytest.raises(ConfigError, match="not a surface with two sides"):
        geometric.fit(mesh, tmp_path / "run", set=SMALL)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("mesh", "template"),
    [(hill(), grid(2, 2)), (pair(bumpy()), pair(icosphere(1))), (collapsed(bumpy()), None)],
    ids=["open", "two components", "faces without area"],
)
def test_references_that_are_learned(tmp_path, mesh, template):
    """Their training meshes come near (templates are 0.04 to 0.12 away) and keep pieces and boundaries."""
    texture = geometric.fit(mesh, tmp_path / "run", template=template, set=SMALL)
    assert texture.about["fit"][-1]["chamfer"] < 0.025
    assert topology(texture.generate(seed=1)) == topology(mesh)


def test_two_components_are_displaced_alike(run):
    """Without noise: the instance norm is taken over both."""
    two = pair(bumpy())
    moved = replace_about(run[1], noise=0.0).apply(two, start_level=2).mesh.vertices
    count = len(two.vertices) // 2
    assert np.allclose(moved[:count] + [3.0, 0, 0], moved[count:], atol=1e-3)
    assert not np.allclose(moved, two.vertices, atol=1e-2)


def test_edges_are_measured_again_if_wanted(run):
    """On the first level that changes nothing: the mesh's mean edge is 1 there."""
    mesh, again = bumpy(), replace_about(run[1], remeasure=True)
    for start, alike in ((2, True), (1, False)):
        a, b = (texture.apply(mesh, start_level=start).mesh.vertices for texture in (run[1], again))
        assert np.allclose(a, b, atol=1e-5) == alike


def replace_about(texture: GeometricTexture, **changes) -> GeometricTexture:
    return replace(texture, about={**texture.about, **changes})


@pytest.mark.parametrize(("start", "end"), [(-1, 2), (2, 1), (0, 3), (3, None)])
def test_levels_out_of_range(run, start, end):
    with pytest.raises(ConfigError, match="this texture has the levels 0 to 2"):
        run[1].apply(icosphere(2), start_level=start, end_level=end)


def test_too_many_faces(run):
    with pytest.raises(ConfigError, match="remesh it more coarsely"):
        run[1].apply(icosphere(120), start_level=0)


def test_growth_starts_at_the_mesh_and_ends_at_the_result(run):
    mesh = icosphere(3)
    meshes = list(run[1].growth(mesh, frames=4, seed=2, start_level=1))
    assert [len(m.faces) for m in meshes] == [180] * 5 + [720] * 4
    assert np.array_equal(meshes[0].vertices, mesh.vertices)
    assert np.allclose(meshes[2].vertices, (meshes[0].vertices + meshes[4].vertices) / 2, atol=1e-6)
    assert np.allclose(meshes[-1].vertices, run[1].apply(mesh, seed=2, start_level=1).mesh.vertices)


def test_the_advice_is_for_the_levels_that_grow(run):
    """A growth that ends below the usual first level starts at its end."""
    mesh, texture = icosphere(3), run[1]
    assert texture.relative_size(mesh, end_level=1) == texture.relative_size(mesh, start_level=1)
    assert texture.relative_size(mesh, end_level=1) != texture.relative_size(mesh)


def test_interpolation_joins_two_seeds(run):
    mesh = icosphere(3)
    meshes = list(run[1].interpolate(mesh, (0, 1), 5))
    ends = [run[1].apply(mesh, seed=seed).mesh.vertices for seed in (0, 1)]
    assert np.allclose(meshes[0].vertices, ends[0], atol=1e-5)
    assert np.allclose(meshes[-1].vertices, ends[1], atol=1e-5)
    assert not np.allclose(meshes[2].vertices, ends[0], atol=1e-4)


def test_the_great_circle_keeps_the_variance():
    a, b = (torch.randn(5000, 3, generator=torch.Generator().manual_seed(k)) for k in range(2))
    for t in (0.0, 0.3, 0.5, 1.0):
        assert float(slerp(a, b, t).std()) == pytest.approx(1, abs=0.03)
    assert float(torch.lerp(a, b, 0.5).std()) < 0.75
    assert torch.allclose(slerp(a, a, 0.4), a)


def test_variations_of_the_reference(run):
    first, second = (run[1].generate(seed) for seed in (0, 1))
    assert len(first.faces) == 320 and not np.allclose(first.vertices, second.vertices, atol=1e-4)
    # From a level on that does not exist nothing is random: the reconstruction.
    reconstructions = [run[1].generate(seed, start_level=3).vertices for seed in (0, 1)]
    assert np.array_equal(reconstructions[0], reconstructions[1])


def test_resuming_changes_nothing(tmp_path):
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        whole = geometric.fit(bumpy(), tmp_path / "whole", set=SMALL)
        part = [*SMALL, "steps=5"]  # between two steps of one critic, whose optimizer must go on too
        # As many levels from the start: what is trained must not depend on where a run was cut.
        geometric.fit(bumpy(), tmp_path / "part", set=part)
        more = geometric.fit(bumpy(), tmp_path / "part", set=["steps=9"], resume=True)
    finally:
        torch.set_num_threads(threads)
    for a, b in zip(whole.generators, more.generators, strict=True):
        assert same(a, b)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")


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
    assert task.started == 0 and not same(task.generators[3], task.generators[2])
    state.advance()
    assert task.started == 4 and same(task.generators[3], task.generators[2])


def same(one: FaceNetwork, other: FaceNetwork) -> bool:
    pairs = zip(one.parameters, other.parameters, strict=True)
    return all(p.shape == q.shape and torch.equal(p, q) for p, q in pairs)


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


@pytest.mark.parametrize("name", ["spikes", "scales"])
def test_bundled_models_are_found_by_name(name):
    """Without noise they rebuild their reference, about as near as the mesh that they were trained with."""
    assert method_of(name) == METHOD
    texture = GeometricTexture.load(name)
    assert texture.about["name"] == name and texture.levels == 5
    rebuilt = texture.generate(start_level=5)
    assert len(rebuilt.faces) == 5120
    errors = report(rebuilt, normalised(find_reference(name), texture.template)[0])
    assert errors.chamfer < 1.2 * texture.about["fit"][-1]["chamfer"]
    assert errors.normals < 1.2 * texture.about["fit"][-1]["normals"]
