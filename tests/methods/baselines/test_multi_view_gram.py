"""Textures through views: the spectrum and the average in closed form, gradients by finite differences."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.asset import clay
from mitex.cli import main
from mitex.errors import CheckpointError, ConfigError, ImageError
from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.baselines import multi_view_gram
from mitex.methods.baselines.multi_view_gram import MultiViewConfig, MultiViewTexture, fitting
from mitex.methods.baselines.multi_view_gram.gram_average import GramAverage
from mitex.methods.baselines.multi_view_gram.spectrum import COLOURS, CONTRAST, image_of, random_spectrum
from mitex.methods.baselines.multi_view_gram.task import MultiViewTask
from mitex.methods.layout import with_layout
from mitex.methods.texture_views import TextureViews, boxed, random_view
from mitex.runtime import threads
from tests.methods.surface.grids import flat_square
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

CONFIG = MultiViewConfig(
    steps=4,
    resolution=64,
    exemplar_size=32,
    view=32,
    antialias=1,
    layers=("relu1_1", "relu2_1"),
    preview_every=0,
)
SMALL = {
    "resolution": 32,
    "exemplar_size": 32,
    "view": 32,
    "layers": CONFIG.layers,
    "checkpoint_every": 2,
    "preview_every": 0,
}


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return with_layout(icosphere(4), 64)


class TestSpectrum:
    def test_one_coefficient_is_one_wave(self):
        """A cosine whose amplitude falls with its frequency, in the colours of one component."""
        side, row, column = 16, 2, 3
        spectrum = torch.zeros(2, 3, side, side // 2 + 1)
        spectrum[0, 1, row, column] = 0.5
        frequency = math.hypot(row, column) / side
        amplitude = CONTRAST * 2 * 0.5 * (side / frequency) / side**2
        y, x = np.indices((side, side))
        wave = amplitude * np.cos(2 * np.pi * (row * y + column * x) / side)
        expected = wave[..., None] * COLOURS[:, 1].numpy()
        actual = torch.logit(image_of(spectrum).double()).numpy()
        np.testing.assert_allclose(actual, expected, atol=1e-6)

    def test_it_equals_a_slow_inverse_transform(self):
        side = 8
        spectrum = random_spectrum(side, torch.Generator().manual_seed(3)).double()
        half = torch.complex(spectrum[0], spectrum[1]).numpy()
        total = np.zeros((side, side, 3))
        y, x = np.indices((side, side))
        for row in range(side):
            for column in range(side):
                mirrored = column > side // 2
                value = half[:, -row % side, side - column].conj() if mirrored else half[:, row, column]
                away = min(row, side - row), min(column, side - column)
                scale = side / (max(math.hypot(*away), 1) / side)
                wave = np.exp(2j * np.pi * (row * y + column * x) / side)
                if column in (0, side // 2):  # a real picture has the half of both
                    other = half[:, -row % side, column].conj()
                    value = 0.5 * (value + other)
                total += (value[None, None] * scale * wave[..., None]).real / side**2
        expected = CONTRAST * total @ COLOURS.double().numpy().T
        actual = torch.logit(image_of(spectrum)).numpy()
        np.testing.assert_allclose(actual, expected, atol=1e-6)

    def test_nothing_is_grey(self):
        assert torch.equal(image_of(torch.zeros(2, 3, 8, 5)), torch.full((8, 8, 3), 0.5))


class TestGramAverage:
    def test_it_is_the_weighted_mean_of_all_steps(self):
        average, grams = GramAverage({"a": 3}, 0.9), torch.rand(4, 3, 3)
        for gram in grams[:-1]:
            average.add({"a": gram})
        weights = 0.9 ** torch.arange(3, -1, -1)
        expected = (weights[:, None, None] * grams).sum(0) / weights.sum()
        assert torch.allclose(average.blended({"a": grams[-1]})["a"], expected, atol=1e-6)

    def test_gradients_go_straight_through(self):
        average, gram = GramAverage({"a": 2}, 0.95), torch.rand(2, 2, requires_grad=True)
        average.add({"a": torch.rand(2, 2)})
        average.blended({"a": gram})["a"].sum().backward()
        assert gram.grad is not None and torch.equal(gram.grad, torch.ones(2, 2))


class TestViews:
    def test_gradients_to_texels_and_to_the_spectrum(self, ball):
        charts = np.zeros((16, 16), int)
        generator = torch.Generator().manual_seed(2)
        camera = random_view(generator, 10, 12, 12, 24)
        views = TextureViews(boxed(ball), charts, camera, 2)
        weights = torch.rand(24, 24, 3, generator=generator)
        spectrum = (20 * random_spectrum(16, generator)).requires_grad_()

        def loss(texture: torch.Tensor) -> torch.Tensor:
            return (weights * views.picture(texture, camera)[0].square()).sum()

        texture = image_of(spectrum).detach().requires_grad_()
        loss(texture).backward()
        loss(image_of(spectrum)).backward()
        for values, make, gradient in (
            (texture, lambda t: t, texture.grad),
            (spectrum, image_of, spectrum.grad),
        ):
            assert gradient is not None
            direction = torch.rand(values.shape, generator=generator) - 0.5
            step = 1e-3 * direction
            with torch.no_grad():
                difference = (loss(make(values + step)) - loss(make(values - step))) / 2e-3
            assert float(difference) == pytest.approx(float((gradient * direction).sum()), rel=5e-3)

    def test_coverage_is_that_of_the_ball(self, ball):
        camera = random_view(torch.Generator().manual_seed(1), 11, 11, 15, 64)
        views = TextureViews(boxed(ball), np.zeros((8, 8), int), camera, 2)
        picture, coverage = views.picture(torch.full((8, 8, 3), 0.25), camera)
        height = 2 * 11 * math.tan(math.radians(7.5))
        assert float(coverage.mean()) == pytest.approx(math.pi / height**2, rel=0.03)
        assert torch.allclose(picture, 0.25 * coverage[..., None], atol=1e-6)

    def test_cameras_are_everywhere_in_the_shell(self):
        generator = torch.Generator().manual_seed(0)
        origins = np.concatenate([random_view(generator, 10, 12, 10, 8).origin for _ in range(300)])
        distances = np.linalg.norm(origins, axis=1)
        assert distances.min() < 10.1 and distances.max() > 11.9
        assert np.abs((origins / distances[:, None]).mean(0)).max() < 0.1

    def test_the_box(self, rng):
        mesh = boxed(icosphere(3).with_vertices(icosphere(3).vertices * [3.0, 1.0, 0.5] + [5.0, 0.0, 1.0]))
        low, high = mesh.vertices.min(0), mesh.vertices.max(0)
        assert (high - low).max() == pytest.approx(2, rel=1e-6) and np.abs(low + high).max() < 1e-5


class TestTask:
    def test_the_contract(self, ball, exemplar):
        threads(1)
        task = MultiViewTask(CONFIG, exemplar, ball)
        task.average.add({name: torch.eye(gram.shape[0]) for name, gram in task.average.sums.items()})
        assert_loss_is_pure(task, 1)

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_skipped_step_leaves_no_trace(self, fault, ball, exemplar):
        threads(1)
        assert_third_step_leaves_no_trace(lambda: MultiViewTask(CONFIG, exemplar, ball), CONFIG, fault)

    def test_the_exemplar_is_as_large_as_on_the_texels(self, exemplar):
        """On a square of two units that fills the layout, half the texels are one unit."""
        config = replace(CONFIG, resolution=64, exemplar_size=32, view=100)
        square = flat_square(2)
        height = 2 * 11 * math.tan(math.radians(5))
        assert MultiViewTask(config, exemplar, square).exemplar_side == round(100 / height)

    def test_it_is_as_large_on_a_finer_texture(self, exemplar):
        """Half as wide as the layout's square, unless texels are asked for."""
        square, sides = flat_square(2), {}
        for resolution in (64, 128):
            for size in (0, 32):
                config = replace(CONFIG, resolution=resolution, exemplar_size=size, view=200)
                sides[resolution, size] = MultiViewTask(config, exemplar, square).exemplar_side
        assert sides[64, 0] == sides[128, 0] == sides[64, 32] > 1.9 * sides[128, 32]

    def test_options_matter(self, ball, exemplar):
        def value(content=None, **options) -> float:
            task = MultiViewTask(replace(CONFIG, **options), exemplar, ball, content)
            task.average.add({name: torch.eye(gram.shape[0]) for name, gram in task.average.sums.items()})
            return float(task.loss(0, torch.Generator().manual_seed(5)).value.detach())

        plain = value()
        for options in (
            *({"masked": False}, {"memory": 0.5}, {"antialias": 2}, {"fov": 20.0}, {"exemplar_size": 48}),
            *({"farthest": 20.0}, {"nearest": 6.0}, {"view": 48}, {"resolution": 48}),
            *({"seed": 3}, {"layers": ("relu1_1",)}),
        ):
            assert value(**options) != plain
        black = np.zeros((64, 64, 3), np.float32)
        kept = value(black)
        assert kept > plain
        assert value(black, content_weight=200.0) - plain == pytest.approx(2 * (kept - plain), rel=1e-3)
        assert value(black, content_layer="relu1_1") != kept


def test_the_learning_rate_is_how_far_a_step_goes(ball, exemplar):
    """Adam's first step has one length, whatever the gradient."""

    def image(lr: float) -> np.ndarray:
        return multi_view_gram.fit(exemplar, ball, set=SMALL | {"lr": lr}, steps=1).image

    still = image(0.0)
    near, far = (float(np.abs(image(lr) - still).mean()) for lr in (0.01, 0.02))
    assert near > 0 and far == pytest.approx(2 * near, rel=0.2)


def test_the_texture_comes_near(tmp_path):
    """The loss falls, a flat exemplar's colour spreads, and previews are made."""
    red = Exemplar({"albedo": np.full((32, 32, 3), (0.8, 0.3, 0.1), np.float32)}, "red")
    heard, settings = [], {**SMALL, "preview_every": 60, "lr": 0.3, "memory": 0.0}
    texture = multi_view_gram.fit(
        red, icosphere(4), tmp_path / "run", set=settings, steps=60, on_step=heard.append
    )
    assert heard[-1].metrics["loss"] < 0.55 * heard[1].metrics["loss"]
    mean = texture.apply().maps["albedo"].mean((0, 1))
    assert mean[0] > mean[1] + 0.1 > mean[2] + 0.2
    assert (tmp_path / "run" / "previews" / "000060.png").is_file()
    again = MultiViewTexture.load(tmp_path / "run")
    assert np.abs(again.image - texture.image).max() < 1e-3 and again.about["mesh"] == "icosphere4"


def test_a_content_is_read_on_the_mesh_s_own_uvs(tmp_path, monkeypatch):
    """From the command line: a picture twice as large as the texture, red above and blue below."""
    given = []

    class Reached(Exception):
        """Work would begin now."""

    def task(config, target, surface, content):
        given.extend((surface, content))
        raise Reached

    picture = np.zeros((64, 64, 3))
    picture[:32, :, 0] = picture[32:, :, 2] = 1
    write_image(tmp_path / "a.png", picture)
    square = flat_square(2)
    clay(square).export(tmp_path / "square.obj")
    monkeypatch.setattr(fitting, "MultiViewTask", task)
    monkeypatch.chdir(tmp_path)
    words = "fit multi_view_gram --exemplar lava --mesh square.obj --content a.png --out run"
    with pytest.raises(Reached):
        main([*words.split(), "--quiet", "--set", "resolution=32"])
    surface, content = given
    assert content.shape == (32, 32, 3) and surface.uv is not None
    np.testing.assert_allclose(content[:15], np.broadcast_to([1, 0, 0], (15, 32, 3)), atol=0.02)
    np.testing.assert_allclose(content[17:], np.broadcast_to([0, 0, 1], (15, 32, 3)), atol=0.02)
    np.testing.assert_allclose(surface.uv, np.asarray(Mesh.load("square.obj").uv), atol=1e-6)


def test_resuming_changes_nothing(exemplar, tmp_path):
    threads(1)
    whole = multi_view_gram.fit(exemplar, icosphere(4), tmp_path / "whole", set=SMALL, steps=4)
    multi_view_gram.fit(exemplar, icosphere(4), tmp_path / "part", set=SMALL, steps=2)
    part = multi_view_gram.fit(exemplar, icosphere(4), tmp_path / "part", steps=4, resume=True)
    assert np.array_equal(whole.image, part.image)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")
    with pytest.raises(CheckpointError, match="mesh"):
        multi_view_gram.fit(exemplar, icosphere(5), tmp_path / "part", steps=6, resume=True)


class TestRefused:
    @pytest.mark.parametrize(
        ("setting", "message"),
        [
            ("layers=relu9_1", "relu9_1; use some of"),
            ("layers=", "are none"),
            ("content_layer=x", "are x"),
            ("nearest=20", "beyond farthest"),
            ("exemplar_size=31", "choose 0, or 32 or more"),
            ("view=8", "out of range"),
        ],
    )
    def test_settings(self, setting, message, exemplar, ball):
        with pytest.raises(ConfigError, match=message):
            multi_view_gram.fit(exemplar, ball, set=[setting])

    def test_no_colours(self, ball):
        height = Exemplar({"height": np.zeros((32, 32, 1), np.float32)}, "hills")
        with pytest.raises(ImageError, match="hills has no albedo"):
            multi_view_gram.fit(height, ball)

    def test_a_content_without_uvs(self, exemplar, tmp_path):
        write_image(tmp_path / "a.png", np.zeros((32, 32, 3)))
        with pytest.raises(ConfigError, match="no UVs for the content picture"):
            multi_view_gram.fit(exemplar, icosphere(4), content=tmp_path / "a.png")

    def test_another_mesh(self, ball):
        texture = MultiViewTexture(ball, np.full((16, 16, 3), 0.5, np.float32))
        with pytest.raises(ConfigError, match="belongs to mesh 'icosphere4', not to 'grid"):
            texture.apply(grid(2, 2))

    @pytest.mark.parametrize("damage", ["shape", "values", "uv"])
    def test_damaged_files(self, damage, ball, tmp_path):
        image = np.full((16, 16 if damage != "shape" else 8, 3), np.nan if damage == "values" else 0.5)
        mesh = replace(ball, uv=None) if damage == "uv" else ball
        path = MultiViewTexture(mesh, image.astype(np.float32), {}).save(tmp_path / "a.safetensors")
        with pytest.raises(CheckpointError, match="not a multi_view_gram texture"):
            MultiViewTexture.load(path)
