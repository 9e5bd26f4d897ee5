"""Chemicals that react and diffuse: Laplacians in closed form, the system's steps, training and meshes."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError, ImageError
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh, icosphere
from mitex.methods.baselines import reaction_diffusion
from mitex.methods.baselines.reaction_diffusion import (
    PRESETS,
    ReactionDiffusionConfig,
    ReactionDiffusionTexture,
)
from mitex.methods.baselines.reaction_diffusion.laplacian import LARGEST, grid_laplacian, mesh_laplacian
from mitex.methods.baselines.reaction_diffusion.reaction import Reaction, colours, geometric_rates
from mitex.methods.baselines.reaction_diffusion.task import ReactionDiffusionTask
from mitex.methods.baselines.reaction_diffusion.texture import even_cells
from mitex.runtime import threads
from mitex.runtime.precision import VARIABLE
from mitex.sparse import LinearMap
from tests.methods.surface.grids import flat_square
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

CONFIG = ReactionDiffusionConfig(
    steps=4,
    channels=6,
    hidden=8,
    grid=32,
    exemplar_size=32,
    pool=2,
    min_steps=2,
    max_steps=3,
    layers=("relu1_1",),
    preview_every=0,
)
SMALL = [
    *("channels=6", "hidden=8", "grid=32", "exemplar_size=32", "pool=2", "min_steps=2", "max_steps=3"),
    *("layers=relu1_1", "checkpoint_every=2", "preview_every=0"),
]


def pixel_lattice(side: int) -> Mesh:
    """Pixels as vertices, each square of four cut into two triangles."""
    y, x = np.indices((side, side)).reshape(2, -1)
    a = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + side + 1], 1), np.stack([a, a + side + 1, a + side], 1)])
    return Mesh(np.stack([x, y, 0 * x], 1), faces)


class TestLaplacian:
    def test_pixels(self, rng):
        image = rng.random((7, 7))
        expected = sum(np.roll(image, shift, axis) for shift in (1, -1) for axis in (0, 1)) - 4 * image
        np.testing.assert_allclose(grid_laplacian(7) @ image.ravel(), expected.ravel(), atol=1e-12)

    def test_on_a_flat_lattice_it_is_the_stencil_of_pixels(self, rng):
        """Inside, in units of the mean cell, which the border makes a little smaller than a pixel."""
        side = 9
        image, lattice = rng.random((side, side)), pixel_lattice(side)
        actual = (mesh_laplacian(lattice) @ image.ravel()).reshape(side, side) / ((side - 1) / side) ** 2
        expected = (grid_laplacian(side) @ image.ravel()).reshape(side, side)
        np.testing.assert_allclose(actual[1:-1, 1:-1], expected[1:-1, 1:-1], atol=1e-9)

    def test_on_a_sphere_it_knows_the_harmonics(self):
        """The squared slopes of z are twice the squares of z, over the whole sphere."""
        ball = icosphere(16)
        z, area = ball.vertices[:, 2].astype(np.float64), np.zeros(len(ball.vertices))
        np.add.at(area, ball.faces, ball.face_areas[:, None] / 3)
        slopes = -(z * area * (mesh_laplacian(ball) @ z)).sum() / area.mean()
        assert slopes == pytest.approx(2 * (z * z * area).sum(), rel=0.01)

    def test_diffusion_is_stable_on_every_mesh(self, rng):
        ball = icosphere(5)
        spiky = ball.with_vertices(ball.vertices * rng.uniform(0.2, 1.0, (len(ball.vertices), 1)))
        matrix = mesh_laplacian(spiky)
        diagonal = matrix.diagonal()
        off = matrix.toarray() - np.diag(diagonal)
        assert off.min() >= 0 and diagonal.min() >= -LARGEST - 1e-9 and diagonal.min() < -4
        assert np.abs(matrix.sum(1)).max() < 1e-9


class TestReaction:
    def test_it_has_as_many_parameters_as_published(self, exemplar):
        config = replace(PRESETS["default"], grid=32, exemplar_size=32, pool=1)
        assert sum(p.numel() for p in ReactionDiffusionTask(config, exemplar).parameters) == 8320

    def test_steps_of_time(self):
        generator, side = torch.Generator().manual_seed(0), 5
        tensors = {
            name: 0.3 * torch.randn(*shape, generator=generator)
            for name, shape in (("inner", (4, 3)), ("bias", (4,)), ("outer", (3, 4)))
        }
        reaction, matrix = Reaction(tensors, torch.tensor([0.02, 0.05, 0.1])), grid_laplacian(side)
        state = torch.randn(side * side, 3, generator=generator)
        expected = state.double().numpy()
        inner, bias, outer = (tensors[name].double().numpy() for name in ("inner", "bias", "outer"))
        for _ in range(3):
            hidden = expected @ inner.T + bias
            active = hidden / (1 + np.exp(-5 * hidden))
            expected = expected + reaction.rates.numpy() * (matrix @ expected) + 0.1 * active @ outer.T
        actual = reaction.evolve(state, LinearMap(matrix), 3)
        assert np.abs(expected).max() < 3
        np.testing.assert_allclose(actual.numpy(), expected, atol=1e-5)

    def test_without_a_reaction_it_only_diffuses(self):
        generator, laplacian = torch.Generator().manual_seed(0), LinearMap(grid_laplacian(16))
        tensors = {"inner": torch.ones(4, 3), "bias": torch.ones(4), "outer": torch.zeros(3, 4)}
        reaction = Reaction(tensors, geometric_rates(0.01, 0.125, 3))
        start = reaction.start(256, laplacian, generator)
        later = reaction.evolve(start, laplacian, 50)
        assert torch.allclose(later.mean(0), start.mean(0), atol=1e-5)
        spread = later.std(0) / start.std(0)
        assert spread[0] > spread[1] > spread[2]

    def test_much_of_a_chemical_decays_at_first(self):
        generator = torch.Generator().manual_seed(0)
        reaction = Reaction.random(3, 9, geometric_rates(0.01, 0.125, 3), generator)
        state = torch.tensor([[0.0, 0.1, -0.2], [2.0, -2.0, 3.0]])
        expected = torch.tensor([[0.0, 0.0, 0.0], [-0.7, 0.7, -1.1]])
        assert torch.allclose(reaction.speed(state), expected, atol=0.01)

    def test_rates_and_colours(self):
        assert torch.allclose(geometric_rates(0.01, 0.04, 3), torch.tensor([0.01, 0.02, 0.04]))
        assert torch.equal(colours(torch.zeros(2, 5)), torch.full((2, 3), 0.5))


class TestTask:
    def test_the_contract(self, exemplar):
        threads(1)
        assert_loss_is_pure(ReactionDiffusionTask(CONFIG, exemplar), 1)

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_skipped_step_leaves_no_trace(self, fault, exemplar):
        threads(1)
        assert_third_step_leaves_no_trace(lambda: ReactionDiffusionTask(CONFIG, exemplar), CONFIG, fault)

    def test_options_matter(self, exemplar):
        """Of a step from a state that overflows, and of the start; the rest is the loop's."""

        def value(**options) -> float:
            task = ReactionDiffusionTask(replace(CONFIG, **options), exemplar)
            task.pool.mul_(4)
            return float(task.loss(1, torch.Generator().manual_seed(5)).value.detach())

        plain = value()
        for options in (
            *({"overflow_weight": 1.0}, {"slowest": 0.05}, {"fastest": 0.06}, {"exemplar_size": 40}),
            *({"layers": ("relu1_2",)}, {"channels": 7}, {"hidden": 9}, {"grid": 40}, {"seed": 1}),
            *({"inject_every": 1}, {"min_steps": 3}, {"min_steps": 5, "max_steps": 6}, {"pool": 3}),
        ):
            assert value(**options) != plain, options

    def test_bfloat16_changes_a_step_little(self, exemplar, monkeypatch):
        def evolved(setting: str) -> tuple[torch.Tensor, torch.Tensor]:
            monkeypatch.setenv(VARIABLE, setting)
            task = ReactionDiffusionTask(CONFIG, exemplar)
            step = task.loss(1, torch.Generator().manual_seed(0))
            gradients = torch.autograd.grad(step.value, task.parameters)
            step.commit()
            return task.pool, torch.cat([g.flatten() for g in gradients])

        exact, mixed = evolved("0"), evolved("1")
        assert 0 < (exact[0] - mixed[0]).abs().max() < 0.01
        assert torch.cosine_similarity(exact[1], mixed[1], dim=0) > 0.99

    def test_the_width_of_a_fit_is_that_of_its_texture(self, exemplar):
        texture = reaction_diffusion.fit(exemplar, set=[*SMALL, "width=0.3", "exemplar_size=40"], steps=1)
        assert (texture.width, texture.cells) == (0.3, 40)

    def test_the_pool_goes_on_and_starts_anew(self, exemplar):
        task = ReactionDiffusionTask(replace(CONFIG, inject_every=4, pool=1), exemplar)
        generator, spreads = torch.Generator().manual_seed(0), []
        for step in (1, 2, 3, 4):
            task.loss(step, generator).commit()
            spreads.append(float(task.pool.std()))
        assert spreads[0] > spreads[1] > spreads[2] < 0.95 * spreads[3]

    def test_a_state_that_explodes_does_not_go_back(self, exemplar):
        task = ReactionDiffusionTask(CONFIG, exemplar)
        before = task.pool.clone()
        with torch.no_grad():
            task.named["outer"].mul_(-100)
        step = task.loss(1, torch.Generator().manual_seed(0))
        step.commit()
        assert step.metrics["overflow"] > 0.5 and torch.equal(task.pool, before)

    def test_training_comes_near(self, exemplar, tmp_path):
        heard = []
        settings = [*SMALL[:-1], "preview_every=60", "lr=0.01", "hidden=16"]
        reaction_diffusion.fit(exemplar, tmp_path / "run", set=settings, steps=60, on_step=heard.append)
        losses = [report.metrics["gram"] for report in heard[1:]]
        assert np.median(losses[-10:]) < 0.6 * np.median(losses[:10])
        assert (tmp_path / "run" / "previews" / "000060.png").is_file()

    def test_resuming_changes_nothing(self, exemplar, tmp_path):
        threads(1)
        whole = reaction_diffusion.fit(exemplar, tmp_path / "whole", set=SMALL, steps=4)
        reaction_diffusion.fit(exemplar, tmp_path / "part", set=SMALL, steps=2)
        part = reaction_diffusion.fit(exemplar, tmp_path / "part", steps=4, resume=True)
        for name, weights in whole.reaction.tensors.items():
            assert torch.equal(weights, part.reaction.tensors[name])
        assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")


def texture(channels: int = 4, **options) -> ReactionDiffusionTexture:
    """Chemicals that decay, so that blobs of colour fade."""
    generator = torch.Generator().manual_seed(0)
    reaction = Reaction.random(channels, 5, geometric_rates(0.01, 0.1, channels), generator)
    return ReactionDiffusionTexture(reaction, **({"cells": 16, "width": 0.5} | options))


class TestTexture:
    def test_cells_are_as_large_as_the_exemplar_s_pixels(self):
        """On a square of one unit that fills the layout, 16 cells along half its side are 32 along all."""
        cells = even_cells(flat_square(4), 0.5 / 16)
        assert len(cells.vertices) == pytest.approx(32 * 32, rel=0.1)

    def test_options_matter(self):
        ball, own = icosphere(6), texture()
        plain = own.apply(ball, steps=2, resolution=32).maps["albedo"]
        assert plain.shape == (32, 32, 3) and plain.std() > 0.01
        small = partial(own.apply, ball, resolution=32)
        for again in (small(seed=1, steps=2), small(steps=8), small(steps=2, scale=2.0)):
            assert not np.array_equal(again.maps["albedo"], plain)
        square = flat_square(4)
        kept = own.apply(square, steps=2, resolution=32, keep_uvs=True)
        assert kept.atlas is not None and square.uv is not None
        assert np.array_equal(kept.atlas.uv, square.uv)

    def test_files(self, tmp_path):
        own = texture()
        again = ReactionDiffusionTexture.load(own.save(tmp_path / "a.safetensors"))
        assert (again.cells, again.width) == (16, 0.5)
        ball = icosphere(5)
        assert np.array_equal(again.grown(ball, 3, 2), own.grown(ball, 3, 2))

    @pytest.mark.parametrize("damage", ["shape", "values", "cells", "width"])
    def test_damaged_files(self, damage, tmp_path):
        options = {"cells": {"cells": 0}, "width": {"width": -1.0}}.get(damage, {})
        own = texture(**options)
        tensors = dict(own.reaction.tensors)
        if damage == "shape":
            tensors["bias"] = torch.zeros(3)
        if damage == "values":
            tensors["outer"] = tensors["outer"] / 0
        path = replace(own, reaction=Reaction(tensors, own.reaction.rates)).save(tmp_path / "a.safetensors")
        with pytest.raises(CheckpointError, match="not a reaction_diffusion texture"):
            ReactionDiffusionTexture.load(path)

    @pytest.mark.parametrize(
        "options",
        [
            *({"scale": 0.01}, {"resolution": 8}, {"steps": -1}, {"steps": 20_000}),
            *({"seed": -1}, {"seed": 2**32}),
        ],
    )
    def test_numbers_out_of_range(self, options):
        with pytest.raises(ConfigError, match=f"`{next(iter(options))}` .* is out of range"):
            texture().apply(icosphere(4), **options)

    def test_too_many_cells(self):
        with pytest.raises(ConfigError, match="cells; use a larger scale"):
            texture(cells=4000).apply(icosphere(4))


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("layers=relu9_1", "relu9_1; use some of"),
        ("layers=", "are none"),
        ("max_steps=3", "or more"),
        ("fastest=0.3", "range"),
    ],
)
def test_settings_that_are_refused(setting, message, exemplar):
    with pytest.raises(ConfigError, match=message):
        reaction_diffusion.fit(exemplar, set=[setting])


def test_no_colours():
    with pytest.raises(ImageError, match="has no albedo"):
        reaction_diffusion.fit(Exemplar({"height": np.zeros((32, 32, 1), np.float32)}))
