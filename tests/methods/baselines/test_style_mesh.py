"""StyleMesh: sums of textures, what pixels count for, gradients weighted by it, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError, ImageError
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh, icosphere
from mitex.methods.baselines import style_mesh
from mitex.methods.baselines.style_mesh import StyleMeshConfig, StyleMeshTexture, visible
from mitex.methods.baselines.style_mesh.layered import (
    fine_energy,
    keep_in_range,
    sum_of,
    within_range,
    zero_textures,
)
from mitex.methods.baselines.style_mesh.task import StyleMeshTask
from mitex.methods.baselines.style_mesh.visible import (
    Counting,
    Visible,
    cameras_around,
    places_in,
    shares,
)
from mitex.methods.layout import with_layout
from mitex.runtime import threads
from mitex.scenes.stage import Stage
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

CONFIG = StyleMeshConfig(
    steps=4,
    resolution=64,
    exemplar_size=64,
    views=3,
    view=64,
    antialias=1,
    layers=("relu1_1", "relu2_1"),
    weights=(1.0, 1.0),
    small_layers=("relu2_1",),
    by_angle=True,
    preview_every=0,
    milestones=(),
)
SMALL = {
    "resolution": 32,
    "exemplar_size": 64,
    "views": 2,
    "view": 64,
    "layers": ("relu1_1",),
    "weights": (1.0,),
    "small_layers": ("relu1_1",),
    "by_angle": True,
    "checkpoint_every": 2,
    "preview_every": 0,
}


@pytest.fixture(scope="module")
def exemplar() -> Exemplar:
    return Exemplar.load("lava").resized(64).of_albedo()


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return with_layout(icosphere(8), 64)


class TestTextures:
    def test_the_start_is_grey(self):
        texture = sum_of(list(zero_textures(16, 3).values()))
        assert torch.equal(texture, torch.tensor([0.485, 0.456, 0.406]).expand(16, 16, 3))

    def test_each_is_interpolated(self):
        """A texture of half the side whose left half is brighter: a ramp of two texels between the halves."""
        fine, coarse = zero_textures(8, 2).values()
        coarse[:, :, :2], fine[:, 0, 0] = 0.2, 0.1
        texture = sum_of([fine, coarse]) - torch.tensor([0.485, 0.456, 0.406])
        expected = torch.tensor([0.2, 0.2, 0.2, 0.15, 0.05, 0, 0, 0])
        assert torch.allclose(texture[3, :, 1], expected, atol=1e-6)
        assert torch.allclose(texture[0, 0], torch.tensor(0.3), atol=1e-6)

    def test_each_stays_in_range_and_their_sum_is_free(self):
        """A texel of the sum that has left it gets the gradient that brings it back."""
        textures = [torch.full((3, 4, 4), 9.0), torch.full((3, 4, 4), -9.0)]
        keep_in_range(textures)
        assert sum_of([textures[0]]).min() == sum_of([textures[0]]).max() == 1
        assert torch.allclose(sum_of([textures[1]]), torch.zeros(4, 4, 3), atol=1e-7)
        dark = torch.full((3, 4, 4), -0.4, requires_grad=True)
        total = sum_of([dark, dark])
        assert total.max() < 0
        total.sum().backward()
        assert dark.grad is not None and bool((dark.grad == 2).all())

    def test_a_clamped_texture_comes_back(self):
        texture = torch.tensor([-0.5, 0.25, 1.5], requires_grad=True)
        shown = within_range(texture)
        assert shown.tolist() == [0, 0.25, 1]
        shown.sum().backward()
        assert texture.grad is not None and texture.grad.tolist() == [1, 1, 1]

    def test_finer_textures_cost_more(self):
        values = [torch.full((3, 2, 2), 0.5) for _ in range(5)]
        assert float(fine_energy(values)) == pytest.approx(0.25 * (8 + 4 + 2))


class TestVisible:
    def test_depth_and_angle_on_a_sphere(self):
        """Rays from 3 units that meet the unit sphere, in closed form."""
        ball = icosphere(40)
        camera = cameras_around(1, 3.0, 45.0, 33)
        visible = Visible.of(Stage(ball), ball, camera)
        direction = camera.rays()[1][0].astype(np.float64)
        origin = camera.origin[0].astype(np.float64)
        b = direction @ origin
        discriminant = b * b - (origin @ origin - 1)
        hit = discriminant > 0.05
        distance = -b - np.sqrt(discriminant.clip(0))
        axis = -origin / np.linalg.norm(origin)
        points = origin + distance[..., None] * direction
        np.testing.assert_allclose(visible.depth[hit], (distance * (direction @ axis))[hit], atol=5e-3)
        np.testing.assert_allclose(visible.cosine[hit], -(points * direction).sum(-1)[hit], atol=0.03)
        outside = discriminant < -0.05
        assert outside.any() and not visible.cosine[outside].any() and np.isinf(visible.depth[outside]).all()

    def test_a_picture_in_which_a_pixel_is_a_texel(self):
        """At depth 2 and 90 degrees a picture is 4 units high, which are 40 texels of 0.1."""
        visible = Visible(np.full((1, 1), 2.0), np.ones((1, 1)))
        assert visible.height(90.0, 0.1)[0, 0] == pytest.approx(40)

    def test_shares_add_up(self, rng):
        heights, wanted = [64, 128, 256], rng.uniform(10, 500, 200)
        parts = np.stack([shares(wanted, heights, k) for k in range(3)])
        np.testing.assert_allclose(parts.sum(0), 1)
        expected = {32: (1, 0, 0), 64: (1, 0, 0), 96: (0.5, 0.5, 0), 128: (0, 1, 0), 224: (0, 0.25, 0.75)}
        for height, share in (expected | {256: (0, 0, 1), np.inf: (0, 0, 1)}).items():
            assert [float(shares(np.array(height), heights, k)) for k in range(3)] == pytest.approx(share)

    def test_areas_and_weights(self):
        """Three pixels that are seen at 0, 45 and 80 degrees, and one that does not count."""
        cosine = np.cos(np.radians([[0.0, 45.0, 80.0, 0.0]]))
        visible, share = Visible(np.ones((1, 4)), cosine), np.array([[1, 0.5, 1, 0]], np.float32)
        pixels = Counting.of(visible, share, 30.0)
        np.testing.assert_allclose(pixels.weight, share * cosine, rtol=1e-6)
        assert [area.tolist() for area in pixels.areas] == [
            [[True, False, False, False]],
            [[False, True, True, False]],
        ]
        plain = Counting.of(visible, share, None)
        assert torch.equal(plain.weight, torch.from_numpy(share))
        assert [area.tolist() for area in plain.areas] == [[[True, True, True, False]]]

    def test_places_in_an_area(self):
        area = torch.zeros(4, 4, dtype=torch.bool)
        area[0, 0] = area[2, 2] = area[3, 3] = True
        assert places_in(area, (4, 4)).tolist() == [0, 10, 15]
        assert places_in(area, (2, 2)).tolist() == [0, 3]
        assert places_in(torch.zeros(4, 4, dtype=torch.bool), (2, 2)).tolist() == []

    def test_a_window_has_a_margin_and_whole_periods(self):
        area = torch.zeros(160, 320, dtype=torch.bool)
        area[50:60, 40], area[70, 200] = True, True
        share = torch.ones(160, 320)
        pixels = Counting(share, 2 * share, [area, torch.zeros_like(area)])
        assert pixels.window() == (slice(32, 96), slice(0, 224))  # 34 to 87 and 24 to 217, rounded outwards
        within = pixels.within(pixels.window())
        assert within.share.shape == within.weight.shape == (64, 224) and within.weight.max() == 2
        assert torch.equal(within.areas[0].nonzero(), area.nonzero() - torch.tensor([32, 0]))
        everywhere = Counting(share, share, [torch.ones_like(area)])
        assert everywhere.window() == (slice(0, 160), slice(0, 320))

    def test_cameras_are_evenly_around(self):
        cameras = cameras_around(100, 2.5, 60.0, 8)
        np.testing.assert_allclose(np.linalg.norm(cameras.origin, axis=1), 2.5, rtol=1e-6)
        assert np.abs(cameras.origin.mean(0)).max() < 0.02
        gaps = np.linalg.norm(cameras.origin[:, None] - cameras.origin[None], axis=2) + 9 * np.eye(100)
        assert gaps.min(1).min() > 0.6 * gaps.min(1).max()


class TestTask:
    def test_gradients_are_weighted_by_what_pixels_count_for(self, ball, exemplar, monkeypatch):
        """Where no pixel counts there are none, and twice the weight gives twice the gradient."""
        task = StyleMeshTask(CONFIG, exemplar, ball)
        task.named["texture0"].data.normal_(0, 0.1, generator=torch.Generator().manual_seed(0))

        def gradient(weight: torch.Tensor) -> torch.Tensor:
            pixels = Counting(weight, weight, [torch.ones(64, 64, dtype=torch.bool)])
            task.named["texture0"].grad = None
            task._picture_loss(task.texture, 0, 0, pixels).backward()
            result = task.named["texture0"].grad
            assert result is not None
            return result

        half = torch.ones(64, 64)
        half[:, :32] = 0
        whole, once, twice = gradient(torch.ones(64, 64)), gradient(half), gradient(2 * half)
        assert torch.allclose(twice, 2 * once, atol=1e-5 * float(once.abs().max()))
        assert 0.2 < float(once.abs().sum() / whole.abs().sum()) < 0.8
        nothing = Counting.of(
            Visible(np.ones((64, 64)), np.ones((64, 64))), np.zeros((64, 64), np.float32), None
        )
        monkeypatch.setattr(task, "_counting", lambda view, k: nothing)
        assert task.loss(0, torch.Generator()).metrics["gram"] == 0

    def test_the_distance_is_that_of_each_area_at_each_height(self, ball, exemplar):
        """By hand: Gram matrices of the features in an area, at the share of its height."""
        task = StyleMeshTask(replace(CONFIG, views=1, coarse_first=0.0), exemplar, ball)
        task.named["texture0"].data.normal_(0, 0.1, generator=torch.Generator().manual_seed(0))
        value = float(task.loss(0, torch.Generator()).value.detach())
        parts, total = [task._counting(0, k).share.mean() for k in range(2)], 0.0
        for k, part in enumerate(parts):
            pixels = task._counting(0, k)
            picture = task.pictures[k].picture(sum_of(task.parameters).detach(), task._camera(0, k))[0]
            for layer in CONFIG.layers:
                maps = task.network.features(picture[None], (layer,))[layer][0]
                step = len(picture) // len(maps)
                for n, area in enumerate(pixels.areas):
                    rows = maps[area[::step, ::step]].float()
                    if not len(rows):
                        continue
                    gram = rows.T @ rows / len(rows)
                    distance = (gram - task.targets[layer]).square().mean()
                    if n == 0 and layer in CONFIG.small_layers:
                        distance += (gram - task.small_targets[layer]).square().mean()
                    total += float(part / sum(parts) * distance)
        assert value == pytest.approx(total, rel=0.02)

    def test_a_network_sees_what_counts_and_little_around_it(self, exemplar, monkeypatch):
        """A thin bar: fewer pixels, and next to the same distance and gradients as of whole pictures."""
        bar = icosphere(8)
        bar = with_layout(bar.with_vertices(bar.vertices * np.array([0.2, 1, 0.2])), 64)
        deep = {"layers": ("relu1_1", "relu3_1"), "small_layers": ("relu3_1",)}
        task = StyleMeshTask(replace(CONFIG, views=1, view=128, coarse_first=0.0, **deep), exemplar, bar)
        task.named["texture0"].data.normal_(0, 0.1, generator=torch.Generator().manual_seed(0))
        sizes = []
        read = task.network.read
        monkeypatch.setattr(task.network, "read", lambda p, taps: sizes.append(p.shape) or read(p, taps))

        def learned() -> tuple[float, torch.Tensor]:
            value = task.loss(0, torch.Generator()).value
            return float(value.detach()), torch.autograd.grad(value, task.named["texture0"])[0]

        cropped, gradient = learned()
        monkeypatch.setattr(visible, "MARGIN", 1000)
        whole, expected = learned()
        assert cropped == pytest.approx(whole, rel=2e-3)
        assert torch.cosine_similarity(gradient.flatten(), expected.flatten(), dim=0) > 0.999
        half = len(sizes) // 2
        seen, pixels = (sum(s[1] * s[2] for s in part) for part in (sizes[:half], sizes[half:]))
        assert seen < 0.6 * pixels

    def test_the_exemplar_is_as_large_on_a_finer_texture(self, ball, exemplar):
        """Half as wide as the layout's square, unless texels are asked for."""
        for resolution, size, side in ((128, 0, 64), (256, 0, 128), (256, 64, 64)):
            config = replace(CONFIG, resolution=resolution, exemplar_size=size, heights=1)
            assert StyleMeshTask(config, exemplar, ball).exemplar_side == side

    def test_the_contract(self, ball, exemplar):
        threads(1)
        assert_loss_is_pure(StyleMeshTask(CONFIG, exemplar, ball), 1)

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_skipped_step_leaves_no_trace(self, fault, ball, exemplar):
        threads(1)
        assert_third_step_leaves_no_trace(lambda: StyleMeshTask(CONFIG, exemplar, ball), CONFIG, fault)

    def test_options_matter(self, ball, exemplar):
        def gradients(**options) -> torch.Tensor:
            config = replace(CONFIG, **({"resolution": 256} | options))
            task = StyleMeshTask(config, exemplar, ball)
            noise = torch.Generator().manual_seed(1)
            for value in task.parameters:
                value.data.normal_(0, 0.1, generator=noise)
            task.loss(0, torch.Generator().manual_seed(5)).value.backward()
            first = task.named["texture0"].grad
            assert first is not None
            return first

        plain = gradients()
        for options in (
            *({"by_depth": False}, {"by_angle": False}, {"heights": 1}, {"frontal": 10.0}, {"views": 5}),
            *(
                {"distance": 4.0},
                {"fov": 40.0},
                {"antialias": 2},
                {"exemplar_size": 80},
                {"coarse_first": 9.0},
            ),
            *(
                {"layers": ("relu2_1",), "weights": (1.0,)},
                {"weights": (1.0, 3.0)},
                {"small_layers": ()},
                {"clamped": False},
                {"textures": 2},
            ),
        ):
            assert not torch.equal(gradients(**options), plain), options


def test_the_texture_comes_near(tmp_path):
    """A flat exemplar's colour spreads over what cameras see, and previews are made."""
    red = Exemplar({"albedo": np.full((64, 64, 3), (0.8, 0.3, 0.1), np.float32)}, "red")
    settings = SMALL | {"preview_every": 25, "lr": 0.05}
    texture = style_mesh.fit(red, icosphere(4), tmp_path / "run", set=settings, steps=25)
    mean = texture.apply().maps["albedo"].mean((0, 1))
    assert mean[0] > mean[1] + 0.1 > mean[2] + 0.2
    assert (tmp_path / "run" / "previews" / "000025.png").is_file()
    assert StyleMeshTexture.load(tmp_path / "run").about["mesh"] == "icosphere4"


def test_the_texture_is_as_fine_as_the_resolution(exemplar):
    for side in (32, 64):
        texture = style_mesh.fit(exemplar, icosphere(4), set=SMALL | {"resolution": side}, steps=1)
        assert texture.image.shape == (side, side, 3)
        assert texture.apply().maps["albedo"].shape == (side, side, 3)


def test_resuming_changes_nothing(exemplar, tmp_path):
    threads(1)
    style_mesh.fit(exemplar, icosphere(4), tmp_path / "whole", set=SMALL, steps=4)
    style_mesh.fit(exemplar, icosphere(4), tmp_path / "part", set=SMALL, steps=2)
    style_mesh.fit(exemplar, icosphere(4), tmp_path / "part", steps=4, resume=True)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")
    with pytest.raises(CheckpointError, match="mesh"):
        style_mesh.fit(exemplar, icosphere(5), tmp_path / "part", steps=6, resume=True)


class TestRefused:
    @pytest.mark.parametrize(
        ("setting", "message"),
        [
            ("layers=relu9_1", "relu9_1; use some of"),
            ("small_layers=relu2_2", "small_layers holds relu2_2"),
            ("weights=1,2", "2 weights for 5 layers"),
            ("resolution=100", "use a multiple of 8"),
            ("exemplar_size=63", "choose 0, or 64 or more"),
            ("view=8", "out of range"),
            ("frontal=20", "frontal means nothing without by_angle=true; leave it out"),
        ],
    )
    def test_settings(self, setting, message, exemplar, ball):
        with pytest.raises(ConfigError, match=message):
            style_mesh.fit(exemplar, ball, set=[setting])

    def test_no_colours(self, ball):
        height = Exemplar({"height": np.zeros((32, 32, 1), np.float32)}, "hills")
        with pytest.raises(ImageError, match="hills has no albedo"):
            style_mesh.fit(height, ball)
