"""Reliefs are found, resumed, kept and applied; every option matters."""

import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from mitex.cache_entries import results
from mitex.errors import CheckpointError, ConfigError, MitexError
from mitex.mesh import grid, icosphere
from mitex.mesh.self_intersections import piercing_pairs
from mitex.methods import relief
from mitex.methods.layout import layout_side, with_layout
from mitex.methods.relief import ReliefConfig, ReliefTexture
from mitex.methods.relief.start import Start
from mitex.methods.relief.task import ReliefTask
from mitex.paths import cache_dir
from mitex.runtime import threads
from mitex.training import Cancelled
from mitex.training.locate import CHECKPOINT, PREVIOUS
from tests.methods.fits import rough_surfaces
from tests.methods.relief.waves import AMPLITUDE, waves
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

pytestmark = pytest.mark.usefixtures("own_cache", "known_exemplars", "small_previews")
SMALL: dict[str, Any] = {
    "resolution": 32,
    "faces": 400,
    "view": 32,
    "views": 2,
    "width": 1.0,
    "layers": ("relu1_1", "relu2_1"),
    "samples": 64,
    "checkpoint_every": 2,
    "preview_every": 0,
}
FLAT: dict[str, Any] = SMALL | {"start": "flat"}
WITH_MAPS: dict[str, Any] = SMALL | {"surface_steps": 2}
CONFIG = ReliefConfig(steps=4, milestones=(), **FLAT)
DEPTH = 3 * AMPLITUDE
ALL = ("albedo", "height", "normal")


def task_of(config: ReliefConfig = CONFIG) -> ReliefTask:
    """With colours: those of a ball that is red where it is high."""
    ball = with_layout(icosphere(4), config.resolution)
    start = Start.flat(ball, config)
    colours = 0.5 + 0.5 * start.fine.normals.astype(np.float64)
    return ReliefTask(config, waves(*ALL), DEPTH, replace(start, colours=colours))


class TestTask:
    def test_the_contract(self):
        threads(1)
        assert_loss_is_pure(task_of(), 1)

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_skipped_step_leaves_no_trace(self, fault):
        threads(1)
        assert_third_step_leaves_no_trace(task_of, CONFIG, fault)

    def test_options_matter(self):
        def value(**options: Any) -> float:
            task = task_of(replace(CONFIG, **options))
            generator = torch.Generator().manual_seed(0)
            task.named["relief"].data.add_(0.05 * torch.randn(task.offsets.shape, generator=generator))
            return float(task.loss(0, torch.Generator().manual_seed(5)).value.detach())

        plain = value()
        for options in (
            *({"layers": ("relu1_1",)}, {"samples": 32}, {"moment_weight": 1.0}, {"loss": "gram"}),
            *({"views": 3}, {"view": 48}, {"width": 0.8}, {"joint": False}, {"seed": 1}),
            *({"sideways": 0.0}, {"smoothing": 1.0}, {"scale": 1.5}, {"faces": 2000}, {"resolution": 48}),
        ):
            assert value(**options) != plain, options

    def test_the_learning_rate_and_its_falls_count(self):
        def relief_after(**options: Any) -> np.ndarray:
            settings = FLAT | {"lr": 0.01, "milestones": (1,), "decay": 0.3} | options
            return relief.fit(waves(*ALL), icosphere(4), set=settings, steps=3).moved.vertices

        plain = relief_after()
        for options in ({"lr": 0.02}, {"milestones": (2,)}, {"decay": 0.5}):
            assert not np.array_equal(relief_after(**options), plain), options

    def test_a_step_that_sees_nothing_moves_nothing(self, monkeypatch):
        task = task_of()
        cameras = replace(
            task.views.cameras(torch.Generator().manual_seed(0), 2, 1.0, 32), target=[[0, 9, 9]] * 2
        )
        monkeypatch.setattr(task.views, "cameras", lambda *_: cameras)
        step = task.loss(0, torch.Generator().manual_seed(0))
        step.value.backward()
        gradient = task.named["relief"].grad
        assert step.metrics["seen"] == 0 and gradient is not None and not gradient.any()

    def test_it_starts_with_the_heights_of_the_maps(self):
        """In widths of the exemplar, whose unit the mesh's vertices then are in."""
        config = replace(CONFIG, sideways=0.0)
        start = replace(Start.flat(grid(4, 4), config), heights=np.linspace(-0.5, 0.5, 289))
        task = ReliefTask(config, waves(*ALL), DEPTH, start)
        assert task.unit == pytest.approx(0.5 * layout_side(grid(4, 4))) == pytest.approx(1.0)
        heights = task.moved().vertices[:, 2]
        np.testing.assert_allclose(heights, DEPTH * start.heights, atol=1e-4)
        larger = ReliefTask(replace(config, scale=2.0), waves(*ALL), DEPTH, start)
        np.testing.assert_allclose(larger.moved().vertices[:, 2], 2 * DEPTH * start.heights, atol=1e-4)


def test_a_relief_grows_on_a_flat_plane(tmp_path):
    """Heights spread as far as the exemplar's, from nearly none; the loss falls."""
    settings = FLAT | {"faces": 4000, "view": 48, "lr": 2e-3, "smoothing": 4.0, "preview_every": 60}
    losses = []
    texture = relief.fit(
        waves("height", "normal"),
        grid(8, 8),
        tmp_path / "run",
        set=settings,
        steps=60,
        on_step=lambda progress: losses.append(progress.loss),
    )
    assert np.mean(losses[-5:]) < 0.7 * losses[1]
    spread = texture.moved.vertices[:, 2].std()
    exemplar = DEPTH * waves("height").maps["height"].std()
    assert 0.5 < spread / exemplar < 2 and texture.plain.vertices[:, 2].std() == 0
    assert texture.about["depth"] == pytest.approx(DEPTH, rel=0.05)
    assert texture.about["piercing_before"] == 0
    assert texture.about["piercing"] == len(piercing_pairs(texture.moved))
    assert (tmp_path / "run" / "previews" / "000060.png").is_file()
    grey = ReliefTexture.load(tmp_path / "run").apply()
    assert len(np.unique(grey.maps["albedo"])) == 1  # no exemplar's colours
    np.testing.assert_array_equal(grey.mesh.vertices, texture.moved.vertices)


def test_faces_that_pierce_each_other_are_counted_on_the_moved_mesh_and_before(monkeypatch):
    def pairs(mesh):
        return range(2 if np.ptp(mesh.vertices[:, 2]) == 0 else 3)

    monkeypatch.setattr("mitex.methods.relief.fitting.piercing_pairs", pairs)
    about = relief.fit(waves("height", "normal"), grid(4, 4), set=FLAT, steps=1).about
    assert (about["piercing_before"], about["piercing"]) == (2, 3)


def test_maps_are_as_fine_as_the_resolution():
    """Synthesized as they are by default, but for the number of steps."""
    texture = relief.fit(waves(*ALL), icosphere(4), set=WITH_MAPS | {"resolution": 48}, steps=1)
    assert texture.textures["albedo"].shape == texture.apply().maps["albedo"].shape == (48, 48, 3)


class TestMaps:
    @pytest.fixture(autouse=True)
    def _rough(self, monkeypatch):
        rough_surfaces(monkeypatch)

    def test_colours_are_those_of_surface_and_kept(self, tmp_path):
        """The second fit finds the maps in the cache: `surface` takes no step."""
        stages: list[str] = []
        options: Any = {
            "set": WITH_MAPS,
            "steps": 2,
            "on_step": lambda progress: stages.append(progress.stage),
        }
        texture = relief.fit(waves(*ALL), icosphere(4), tmp_path / "one", **options)
        assert texture.textures.keys() == {"albedo"}  # bumps are on the mesh
        kept = len(results())
        assert stages == 3 * ["surface"] + 3 * ["relief"]
        again = relief.fit(waves(*ALL), icosphere(4), tmp_path / "two", **options)
        assert stages[6:] == 3 * ["relief"] and len(results()) == kept
        np.testing.assert_array_equal(again.textures["albedo"], texture.textures["albedo"])
        asset = texture.apply(icosphere(4))
        assert asset.texture_maps is not None
        np.testing.assert_array_equal(asset.texture_maps["albedo"], texture.textures["albedo"])
        np.testing.assert_array_equal(asset.mesh.vertices, texture.moved.vertices)

    def test_a_fit_in_memory_keeps_nothing(self):
        before = len(results())
        relief.fit(waves(*ALL, side=48), icosphere(4), set=WITH_MAPS, steps=1)
        assert len(results()) == before

    @pytest.mark.parametrize(("left", "side"), [(CHECKPOINT, 40), (PREVIOUS, 44)])
    def test_a_synthesis_that_was_stopped_goes_on(self, left, side, tmp_path):
        """Also if it was stopped while it saved, when the checkpoint has its other name."""
        inputs = waves(*ALL, side=side), icosphere(4), tmp_path / "run"
        settings: Any = {"set": WITH_MAPS | {"surface_steps": 6}, "steps": 1}
        stop, steps = threading.Event(), []

        def on_step(progress):
            steps.append(progress.step)
            if progress.step == 4:
                stop.set()

        with pytest.raises(Cancelled):
            relief.fit(*inputs, **settings, on_step=on_step, cancel=stop)
        assert steps == [0, 1, 2, 3, 4] and not (tmp_path / "run").exists()
        (training,) = (cache_dir() / "relief").glob("*.run")
        (training / CHECKPOINT).rename(training / left)
        relief.fit(*inputs, **settings, on_step=lambda progress: steps.append(progress.step))
        assert steps[5:] == [4, 5, 6, 0, 1]

    def test_more_settings_matter(self):
        def albedo(**options: Any) -> np.ndarray:
            settings = WITH_MAPS | options
            return relief.fit(waves(*ALL), icosphere(4), set=settings, steps=1).textures["albedo"]

        plain = albedo()
        for options in ({"surface_steps": 3}, {"scale": 2.5}, {"seed": 1}):
            assert not np.array_equal(albedo(**options), plain), options


def test_resuming_changes_nothing(tmp_path):
    threads(1)
    relief.fit(waves(*ALL), icosphere(4), tmp_path / "whole", set=FLAT, steps=4)
    relief.fit(waves(*ALL), icosphere(4), tmp_path / "part", set=FLAT, steps=2)
    relief.fit(waves(*ALL), icosphere(4), tmp_path / "part", steps=4, resume=True)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")
    for exemplar, mesh, word in (
        (waves(*ALL), icosphere(5), "mesh"),
        (waves(*ALL, side=48), icosphere(4), "exemplar"),
    ):
        with pytest.raises(CheckpointError, match=word):
            relief.fit(exemplar, mesh, tmp_path / "part", steps=6, resume=True)


def test_piercing_parts_are_drawn_back():
    """Two plates above each other, the lower one pushed through the upper one."""
    low = grid(12, 12)
    assert low.uv is not None
    vertices = np.concatenate([low.vertices, low.vertices + np.array([0.013, 0.027, 0.1], np.float32)])
    plates = replace(
        low,
        vertices=vertices,
        faces=np.concatenate([low.faces, low.faces + len(low.vertices)]),
        uv=np.concatenate([0.5 * low.uv, 0.5 * low.uv + np.array([0.5, 0], np.float32)]),
    )
    push = 0.4 * np.exp(-(vertices[:, :2] ** 2).sum(1) / 0.04) * (vertices[:, 2] < 0.05)
    moved = plates.with_vertices(vertices + push[:, None] * np.array([0, 0, 1], np.float32))
    texture = ReliefTexture(plates, plates, moved, {})
    assert texture.apply().mesh.vertices[:, 2].max() > 0.3
    assert texture.apply(untangle=True).mesh.vertices[:, 2].max() < 0.15


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"set": {"layers": ("relu9_9",)}}, "relu9_9"),
        ({"set": {"scale": 0.05, "resolution": 64}}, "texels wide"),
        ({"set": {"start": "round"}}, "start"),
        ({"keep_uvs": True}, "UVs"),
    ],
)
def test_what_is_refused(options, problem, tmp_path):
    with pytest.raises(MitexError, match=problem):
        relief.fit(waves(*ALL), icosphere(4), tmp_path / "run", **options)
    assert not (tmp_path / "run").exists()


def test_another_mesh_is_refused():
    ball = with_layout(icosphere(4), 32)
    with pytest.raises(ConfigError, match="belongs to mesh"):
        ReliefTexture(ball, ball, ball, {}).apply(icosphere(5))


def test_close_ups_are_as_fine_as_the_mesh():
    """A pixel for each edge, as far as that leaves enough of the exemplar for four layers."""
    plane = grid(20, 20)
    for faces, side in ((1, 32), (8000, None)):
        config = replace(CONFIG, width=0.0, faces=faces, resolution=256)
        task = ReliefTask(config, waves(*ALL), DEPTH, Start.flat(plane, config))
        cell = 0.1 / (1 if faces == 1 else 4) / task.unit
        edge = cell * (2 + np.sqrt(2)) / 3  # the mean of two sides and a diagonal
        assert task.pictures.exemplar.shape[1] == (side or pytest.approx(1 / edge, abs=1))
        assert task.width == config.view / task.pictures.exemplar.shape[1]
