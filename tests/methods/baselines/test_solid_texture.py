"""Solid textures: the network against a plain one, boxes that fit together, noise, lookup, refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image
from torch import nn

from mitex.errors import CheckpointError, ConfigError, ImageError
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.mesh import icosphere
from mitex.methods.baselines import solid_texture
from mitex.methods.baselines.solid_texture import PRESETS, SolidConfig, SolidTexture
from mitex.methods.baselines.solid_texture.boxes import Box, needed
from mitex.methods.baselines.solid_texture.convolution import convolve
from mitex.methods.baselines.solid_texture.generator import (
    CHANNELS,
    KERNELS,
    NOISE,
    SCALES,
    SLOPE,
    Generator,
    noise_boxes,
    shapes,
)
from mitex.methods.baselines.solid_texture.noise import hashed_noise
from mitex.methods.baselines.solid_texture.task import SolidTask
from mitex.methods.baselines.solid_texture.texture import interpolated
from mitex.runtime import threads
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

CONFIG = SolidConfig(
    steps=4, exemplar_size=32, slice_size=32, layers=("relu1_1", "relu2_1"), preview_every=0, milestones=()
)
SMALL = {
    "exemplar_size": 32,
    "slice_size": 32,
    "layers": CONFIG.layers,
    "checkpoint_every": 2,
    "preview_every": 0,
}


@pytest.fixture
def generator() -> Generator:
    """With gains, shifts and statistics of all kinds."""
    random = torch.Generator().manual_seed(3)
    result = Generator.random(random)
    for name, value in {**result.tensors, **result.statistics}.items():
        if name.rsplit("/")[-1] in ("gain", "shift", "mean", "variance"):
            value.copy_(0.5 + torch.rand(value.shape, generator=random))
    return result


@pytest.fixture
def briefly_settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Statistics at the end of a fit come from three slices, not thirty."""
    monkeypatch.setattr("mitex.methods.baselines.solid_texture.task.SETTLING", 1)


def hashed(box: Box, seed: int = 0) -> list[torch.Tensor]:
    return [torch.from_numpy(hashed_noise(b, NOISE, k, seed))[None] for k, b in enumerate(noise_boxes(box))]


class TestGenerator:
    def test_as_many_weights_as_published(self):
        assert sum(math.prod(shape) for shape in shapes().values()) == 84_963

    def test_it_equals_torch_s_layers_on_a_whole_volume(self, generator):
        """Cubes that all begin at a multiple of 32, so that nothing needs to be cut to an odd place."""

        def block(name: str, values: torch.Tensor) -> torch.Tensor:
            for k, kernel in enumerate(KERNELS):
                weight = generator.tensors[f"{name}/{k}/weight"]
                convolution = nn.Conv3d(weight.shape[1], weight.shape[0], kernel)
                convolution.load_state_dict(
                    {n: generator.tensors[f"{name}/{k}/{n}"] for n in ("weight", "bias")}
                )
                values = nn.LeakyReLU(SLOPE)(norm(f"{name}/{k}", convolution(values)))
            return values

        def norm(name: str, values: torch.Tensor) -> torch.Tensor:
            layer = nn.BatchNorm3d(values.shape[1]).eval()
            layer.weight.data, layer.bias.data = (generator.tensors[f"{name}/{n}"] for n in ("gain", "shift"))
            layer.running_mean, layer.running_var = (
                generator.statistics[f"{name}/{n}"] for n in ("mean", "variance")
            )
            return layer(values)

        box = Box((4, 2, 0), (6, 5, 7))
        coarsest = needed(box, SCALES)[-1]
        noise = hashed(box)
        with torch.no_grad():
            values, start = block(f"noise{SCALES - 1}", noise[-1]), np.array(coarsest.start)
            for scale in range(SCALES - 2, -1, -1):
                up = nn.Upsample(scale_factor=2, mode="nearest")(values)
                up, start = norm(f"up{scale}", up), 2 * start
                target = needed(box, SCALES)[scale]
                cut = up
                for axis in range(3):
                    first = target.start[axis] - 2 - start[axis]
                    cut = cut.narrow(2 + axis, int(first), target.size[axis] + 4)
                values = block(f"join{scale}", torch.cat([cut, block(f"noise{scale}", noise[scale])], 1))
                start = np.array(target.start)
            levels = nn.functional.conv3d(
                values, generator.tensors["colour/weight"], generator.tensors["colour/bias"]
            )
            expected = levels[0] / 255 + torch.tensor([0.485, 0.456, 0.406]).view(3, 1, 1, 1)
            actual = generator.colours(box, noise)[0]
        assert actual.shape == (3, 6, 5, 7) and values.shape[1] == CHANNELS * SCALES
        torch.testing.assert_close(actual, expected, atol=1e-5, rtol=1e-5)

    @torch.no_grad()
    def test_boxes_fit_together_wherever_they_begin(self, generator):
        whole = Box((-9, 5, 30), (12, 10, 11))
        expected = generator.colours(whole, hashed(whole))[0]
        for offset in ((0, 0, 0), (3, 4, 1), (7, 5, 6)):
            part = Box(tuple(s + o for s, o in zip(whole.start, offset, strict=True)), (5, 5, 5))
            x, y, z = (slice(o, o + 5) for o in offset)
            actual = generator.colours(part, hashed(part))[0]
            torch.testing.assert_close(actual, expected[:, x, y, z], atol=1e-5, rtol=1e-5)

    def test_training_normalises_by_the_batch_and_moves_the_statistics(self, generator):
        box = Box((0, 0, 0), (8, 8, 1))
        noise = [torch.rand(2, NOISE, *b.size) for b in noise_boxes(box)]
        updated = {name: value.clone() for name, value in generator.statistics.items()}
        generator.colours(box, noise, updated)
        raw = nn.functional.conv3d(
            noise[0], generator.tensors["noise0/0/weight"], generator.tensors["noise0/0/bias"]
        )
        before = generator.statistics["noise0/0/mean"]
        torch.testing.assert_close(updated["noise0/0/mean"], 0.9 * before + 0.1 * raw.mean((0, 2, 3, 4)))
        assert not torch.equal(updated["up0/variance"], generator.statistics["up0/variance"])


@pytest.mark.parametrize("size", [(3, 9, 8), (9, 4, 8), (7, 8, 5), (6, 6, 6)])
@pytest.mark.parametrize("kernel", [1, 3])
def test_convolutions_are_those_of_torch(size, kernel):
    generator = torch.Generator().manual_seed(6)
    shapes = (2, 5, *size), (4, 5, kernel, kernel, kernel), (4,)
    inputs = values, weight, bias = [torch.randn(s, generator=generator, requires_grad=True) for s in shapes]
    expected, actual = nn.functional.conv3d(values, weight, bias), convolve(values, weight, bias)
    assert actual.shape == expected.shape and torch.allclose(actual, expected, atol=1e-5)
    factors = torch.randn(expected.shape, generator=generator)
    theirs, ours = (torch.autograd.grad((factors * v).sum(), inputs) for v in (expected, actual))
    for a, b in zip(ours, theirs, strict=True):
        assert torch.allclose(a, b, rtol=1e-4, atol=1e-4)


class TestNoise:
    def test_it_is_uniform_and_uncorrelated(self):
        values = hashed_noise(Box((-20, 5, 1000), (40, 40, 40)), 3, 2, 7).astype(np.float64)
        assert values.min() >= 0 and values.max() < 1
        histogram = np.histogram(values, 16, (0, 1))[0] / values.size
        assert np.abs(histogram - 1 / 16).max() < 2e-3
        centred = values - 0.5
        for axis in (1, 2, 3):
            pairs = centred * np.roll(centred, 1, axis)
            assert abs(pairs.mean() * 12) < 0.02
        assert abs((centred[0] * centred[1]).mean() * 12) < 0.02

    def test_it_depends_on_the_place_alone(self):
        whole = hashed_noise(Box((-3, 0, 9), (8, 8, 8)), 3, 1, 5)
        part = hashed_noise(Box((-1, 4, 10), (2, 3, 4)), 3, 1, 5)
        assert np.array_equal(part, whole[:, 2:4, 4:7, 1:5])
        for other in ((1, 6), (2, 5)):
            assert not np.array_equal(hashed_noise(Box((-3, 0, 9), (8, 8, 8)), 3, *other), whole)


class TestTexture:
    def test_lookup_is_trilinear(self, rng):
        grid = np.stack(np.meshgrid(*[np.arange(5.0)] * 3, indexing="ij"))
        values = np.stack([grid[0] + 2 * grid[1], grid[1] * grid[2]])
        points = rng.uniform(0, 4, (50, 3))
        x, y, z = points.T
        expected = np.stack([x + 2 * y, y * z], 1)
        np.testing.assert_allclose(interpolated(values, points), expected, atol=1e-5)

    def test_points_of_many_blocks(self, generator):
        """Each as if alone, and without a jump from one block to the next."""
        texture = SolidTexture(generator, 32, 0.5)
        points = np.array([[31.999, 3.0, -0.001], [32.001, 3.0, 0.001], [5.5, 40.25, -70.0]])
        together = texture.at(points)
        for point, value in zip(points, together, strict=True):
            np.testing.assert_allclose(texture.at(point[None])[0], value, atol=1e-6)
        assert np.abs(together[0] - together[1]).max() < 1e-2
        whole = np.floor(points[2])
        box = Box(tuple(int(v) for v in whole), (2, 2, 1))
        with torch.no_grad():
            corners = generator.colours(box, hashed(box))[0].clamp(0, 1).numpy()
        mean = (corners[:, :, 0] * 0.75 + corners[:, :, 1] * 0.25).mean(1)[:, 0]
        np.testing.assert_allclose(together[2], mean, atol=1e-5)

    def test_options_matter(self, generator):
        texture, ball = SolidTexture(generator, 32, 1.0), icosphere(4)

        def albedo(**options) -> np.ndarray:
            return texture.apply(ball, **({"resolution": 32, "scale": 8.0} | options)).maps["albedo"]

        plain = albedo()
        assert plain.shape == (32, 32, 3)
        assert not np.array_equal(albedo(seed=1), plain)
        assert not np.array_equal(albedo(scale=4.0), plain)
        assert albedo(resolution=16).shape == (16, 16, 3)

    def test_it_comes_back_from_its_file(self, generator, tmp_path):
        path = SolidTexture(generator, 32, 0.5, {"name": "a"}).save(tmp_path / "a.safetensors")
        again = SolidTexture.load(path)
        points = np.array([[0.5, 1.5, 2.5]])
        assert np.array_equal(again.at(points), SolidTexture(generator, 32, 0.5).at(points))
        assert (again.voxels, again.width) == (32, 0.5)


class TestTask:
    def test_the_contract(self, exemplar):
        threads(1)
        assert_loss_is_pure(SolidTask(CONFIG, exemplar), 1)

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_skipped_step_leaves_no_trace(self, fault, exemplar):
        threads(1)
        assert_third_step_leaves_no_trace(lambda: SolidTask(CONFIG, exemplar), CONFIG, fault)

    @torch.no_grad()
    def test_the_published_loss_by_hand(self, exemplar):
        """Raw features, matrices divided by h w c, and slices that are drawn and normalised one by one."""
        config = replace(PRESETS["paper"], exemplar_size=32, slice_size=48, slices=2)
        task, network = SolidTask(config, exemplar), Vgg16(precision="float32", normalised=False)

        def grams(picture: torch.Tensor) -> list[torch.Tensor]:
            maps = network.features(picture[None], config.layers).values()
            rows = [values[0].flatten(0, 1).double() for values in maps]
            return [torch.einsum("ni,nj->ij", r, r) / r.numel() for r in rows]

        generator, expected = torch.Generator().manual_seed(5), 0.0
        targets = grams(torch.from_numpy(exemplar.resized(32).maps["albedo"]))
        statistics = {name: value.clone() for name, value in task.generator.statistics.items()}
        for axis in (0, 0, 1, 1, 2, 2):
            start = torch.randint(0, 32, (3,), generator=generator).tolist()
            size = [48, 48, 48]
            size[axis] = 1
            box = Box(tuple(start), tuple(size))
            noise = [torch.rand(1, NOISE, *b.size, generator=generator) for b in noise_boxes(box)]
            colours = task.generator.colours(box, noise, statistics)[0]
            picture = colours.select(1 + axis, 0).permute(1, 2, 0).contiguous()
            for own, target in zip(grams(picture), targets, strict=True):
                expected += float((own - target).square().mean()) / 6
        step = task.loss(0, torch.Generator().manual_seed(5))
        assert float(step.value) == pytest.approx(expected, rel=0.02)  # bfloat16 where that is fast
        step.commit()
        for name, value in task.generator.statistics.items():
            torch.testing.assert_close(value, statistics[name])

    def test_options_matter(self, exemplar):
        def value(**options) -> float:
            task = SolidTask(replace(CONFIG, **options), exemplar)
            return float(task.loss(0, torch.Generator().manual_seed(5)).value.detach())

        plain = value()
        numbers = {"slices": 2}, {"slice_size": 40}, {"exemplar_size": 40}
        for options in (*numbers, {"layers": ("relu1_1",)}, {"normalised": False}):
            assert value(**options) != plain, options
        assert value(seed=3) != plain


@pytest.mark.usefixtures("briefly_settled")
def test_a_flat_colour_is_learned(tmp_path):
    """On slices as they are trained; statistics of so few voxels are too uneven for the whole volume."""
    red = Exemplar({"albedo": np.full((32, 32, 3), (0.8, 0.3, 0.1), np.float32)}, "red")
    settings = SMALL | {"preview_every": 30, "layers": ("relu1_1",), "milestones": (20, 26)}
    solid_texture.fit(red, tmp_path / "run", set=settings, steps=30)
    with Image.open(tmp_path / "run" / "previews" / "000030.png") as picture:
        slices = np.asarray(picture)[:, 32:] / 255
    assert slices.shape == (32, 96, 3)
    np.testing.assert_allclose(slices.mean((0, 1)), (0.8, 0.3, 0.1), atol=0.15)


@pytest.mark.usefixtures("briefly_settled")
def test_the_width_goes_into_the_texture(exemplar):
    """Half as wide, the pattern is on a mesh what one of scale 2 is."""
    wide, narrow = (solid_texture.fit(exemplar, set=SMALL | {"width": w}, steps=1) for w in (0.5, 0.25))
    assert (wide.width, narrow.width) == (0.5, 0.25)

    def albedo(texture: SolidTexture, scale: float = 1.0) -> np.ndarray:
        return texture.apply(icosphere(4), scale=scale, resolution=16).maps["albedo"]

    assert np.array_equal(albedo(narrow, 2.0), albedo(wide))
    assert not np.array_equal(albedo(narrow), albedo(wide))


@pytest.mark.usefixtures("briefly_settled")
def test_resuming_changes_nothing(exemplar, tmp_path):
    threads(1)
    solid_texture.fit(exemplar, tmp_path / "whole", set=SMALL, steps=4)
    solid_texture.fit(exemplar, tmp_path / "part", set=SMALL, steps=2)
    solid_texture.fit(exemplar, tmp_path / "part", steps=4, resume=True)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")


class TestRefused:
    @pytest.mark.parametrize(
        ("setting", "message"), [("layers=relu9_1", "relu9_1; use some of"), ("slice_size=8", "out of range")]
    )
    def test_settings(self, setting, message, exemplar):
        with pytest.raises(ConfigError, match=message):
            solid_texture.fit(exemplar, set=[setting])

    def test_no_colours(self):
        height = Exemplar({"height": np.zeros((32, 32, 1), np.float32)}, "hills")
        with pytest.raises(ImageError, match="hills has no albedo"):
            solid_texture.fit(height)

    def test_numbers(self, generator):
        texture = SolidTexture(generator, 32, 0.5)
        with pytest.raises(ConfigError, match="`scale` .* is out of range"):
            texture.apply(icosphere(2), scale=100)
        for seed in (-1, 2**32):
            with pytest.raises(ConfigError, match=f"`seed` {seed} is out of range"):
                texture.apply(icosphere(2), seed=seed)
        with pytest.raises(ConfigError, match="larger scale"):
            texture.at(np.random.default_rng(0).uniform(0, 1e6, (30_000, 3)))

    @pytest.mark.parametrize("damage", ["shape", "values", "size"])
    def test_damaged_files(self, damage, generator, tmp_path):
        bias = generator.tensors["colour/bias"]
        broken = {"shape": bias[:2], "values": bias * math.nan, "size": bias}[damage]
        tensors = dict(generator.tensors) | {"colour/bias": broken}
        texture = SolidTexture(replace(generator, tensors=tensors), 32, 0.0 if damage == "size" else 0.5, {})
        with pytest.raises(CheckpointError, match="not a solid_texture texture"):
            SolidTexture.load(texture.save(tmp_path / "a.safetensors"))
