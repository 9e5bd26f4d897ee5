"""Text2Mesh with an image: what views show, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.asset import Asset
from mitex.cli import main
from mitex.errors import CheckpointError, ConfigError, ImageError
from mitex.exemplar import Exemplar
from mitex.features import Vgg16, normalise_colours
from mitex.mesh import Mesh, icosphere
from mitex.methods.baselines import text2mesh
from mitex.methods.baselines.text2mesh import Text2MeshConfig, Text2MeshTexture
from mitex.methods.baselines.text2mesh.config import PRESETS, share_open
from mitex.methods.baselines.text2mesh.task import ROWS, Text2MeshTask
from mitex.methods.exemplar_pictures import albedo
from mitex.methods.layout import with_layout
from mitex.methods.neural_style.cameras import cameras_of
from mitex.runtime import threads
from mitex.runtime.precision import VARIABLE
from mitex.scenes.cameras import orbit
from tests.cli import bad_files
from tests.methods.neural_style.tiny import shaken, tiny
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

SMALL = {
    "resolution": 32,
    "exemplar_size": 32,
    "frequencies": 8,
    "width": 16,
    "view": 48,
    "layers": ("relu1_1", "relu2_1"),
    "samples": 64,
    "checkpoint_every": 2,
    "preview_every": 0,
}
CONFIG = Text2MeshConfig(steps=4, milestones=(), **SMALL)


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return with_layout(icosphere(4), 32)


class TestViews:
    def test_they_show_the_colours_of_places(self, ball, exemplar, monkeypatch):
        """A field that is the place itself: the middle of a view from +z is the pole of the ball."""
        task = Text2MeshTask(CONFIG, exemplar, ball)
        rows = []
        monkeypatch.setattr(
            task, "colours", lambda points, *_: rows.append(len(points)) or 0.5 + 0.5 * points
        )
        views, masks = task.views(orbit(1, elevation=0, distance=2.0, fov=60.0, resolution=49, start=90))
        assert torch.allclose(views[0, 24, 24], torch.tensor([0.5, 0.5, 1.0]), atol=0.02)
        assert views[0, 24, 40, 0] > 0.7 and views[0, 8, 24, 1] > 0.7
        assert masks[0, 24, 24] and not masks[0, 0, 0] and torch.equal(views[0, 0, 0], torch.ones(3))
        assert rows == [ROWS]  # a number that depended on the view would fill torch's cache
        baked = task.baked()
        used = np.unravel_index(task.texels.index, baked.shape[:2])
        np.testing.assert_allclose(baked[used], 0.5 + 0.5 * task.texels.position, atol=1e-5)

    def test_bfloat16_changes_them_little_and_the_baked_texture_not_at_all(self, ball, exemplar, monkeypatch):
        def learned(setting: str) -> tuple[torch.Tensor, torch.Tensor, np.ndarray]:
            monkeypatch.setenv(VARIABLE, setting)
            task = Text2MeshTask(CONFIG, exemplar, ball)
            task.named["colours.2.weight"].data.normal_(generator=torch.Generator().manual_seed(0))
            pictures = task.views(orbit(1, distance=2.0, fov=60.0, resolution=48))[0]
            difference = pictures[..., 0].mean() - pictures[..., 2].mean()
            gradients = torch.cat([g.flatten() for g in torch.autograd.grad(difference, task.parameters)])
            return pictures.detach(), gradients, task.baked()

        exact, mixed = learned("0"), learned("1")
        assert 0 < (exact[0] - mixed[0]).abs().max() < 0.01
        assert torch.cosine_similarity(exact[1], mixed[1], dim=0) > 0.999
        assert not torch.equal(exact[1], mixed[1])
        np.testing.assert_array_equal(exact[2], mixed[2])

    def test_cameras_around_the_front_and_around_all(self):
        def origins(**options) -> np.ndarray:
            config, generator = replace(CONFIG, views=64, **options), torch.Generator().manual_seed(0)
            return cameras_of(config, generator).origin

        front, around = origins(cameras="anchored"), origins()
        for places in (front, around):
            np.testing.assert_allclose(np.linalg.norm(places, axis=1), 2.0, rtol=1e-5)
        np.testing.assert_allclose(front[0], [0, 0, 2], atol=1e-6)
        assert front[:, 2].mean() > 0.3 and abs(around[:, 2].mean()) < 0.3

    def test_cameras_are_spread_as_published(self):
        """Azimuths by a standard deviation of 90 degrees, elevations by 45, up to 80 (Michel et al. 2022)."""
        config, generator = replace(CONFIG, views=64, cameras="anchored"), torch.Generator().manual_seed(0)
        x, y, z = np.concatenate([cameras_of(config, generator).origin[1:] for _ in range(64)]).T / 2
        elevation = np.degrees(np.arcsin(y))
        assert np.abs(elevation).max() == pytest.approx(80, abs=0.01)
        assert np.percentile(np.abs(elevation), 50) == pytest.approx(0.6745 * 45, rel=0.06)
        wrapped = np.random.default_rng(0).normal(0, 90, 1_000_000)
        wrapped = np.abs((wrapped + 180) % 360 - 180)
        assert np.median(np.abs(np.degrees(np.arctan2(x, z)))) == pytest.approx(np.median(wrapped), rel=0.06)


class TestSize:
    def test_the_exemplar_is_as_large_on_a_finer_texture(self, ball, exemplar):
        """Half as wide as the layout's square, unless texels are asked for."""

        def side(resolution: int, size: int) -> int:
            config = replace(CONFIG, resolution=resolution, exemplar_size=size)
            return Text2MeshTask(config, exemplar, ball).exemplar_side

        assert side(64, 0) == side(128, 0) == side(64, 32)
        assert side(128, 32) == pytest.approx(side(64, 32) / 2, abs=1)


class TestLoss:
    def test_it_is_that_of_meshnca(self, ball, exemplar):
        """A view by hand, of all samples: normalised colours by angle and distance, features by angle."""
        side = SMALL["view"]
        options = {"samples": side * side, "moment_weight": 0.0, "layers": ("relu1_1",), "pooling": "average"}
        task = Text2MeshTask(replace(CONFIG, colour_histogram=False, **options), exemplar, ball)
        picture = torch.rand(side, side, 3, generator=torch.Generator().manual_seed(1))
        mask = torch.ones(side, side, dtype=torch.bool)
        theirs = Vgg16().features(albedo(exemplar, side)[None], ("relu1_1",))["relu1_1"][0].flatten(0, 1)
        task.picture, task.targets = (
            normalise_colours(albedo(exemplar, side).flatten(0, 1)),
            {"relu1_1": theirs},
        )
        value = task._view_loss(picture, mask, torch.Generator().manual_seed(0))

        def cost(a, b, euclidean):
            table = 1 - torch.nn.functional.normalize(a, dim=1) @ torch.nn.functional.normalize(b, dim=1).T
            if euclidean:
                table = table + (torch.cdist(a, b) ** 2).clamp(1e-5, 1e5) / 3
            return torch.maximum(table.min(1).values.mean(), table.min(0).values.mean())

        scale = torch.tensor([0.229, 0.224, 0.225])
        mean = torch.tensor([0.485, 0.456, 0.406])
        ours = Vgg16().features(picture[None], ("relu1_1",))["relu1_1"][0].flatten(0, 1)
        assert task.network.extent("relu1_1", side, side) == (side, side)
        wanted = cost(
            (picture.flatten(0, 1) - mean) / scale,
            (albedo(exemplar, side).flatten(0, 1) - mean) / scale,
            True,
        )
        assert float(value) == pytest.approx(float(wanted + cost(ours, theirs, False)), rel=1e-2)

    def test_half_as_bright_is_far(self, ball, exemplar):
        """Colours decide: what is half as bright is farther by far than another draw of the same."""
        task = Text2MeshTask(replace(CONFIG, samples=1024), exemplar, ball)
        raw = albedo(exemplar, task.exemplar_side).flatten(0, 1)
        same, dark = (
            float(task._colour_distance(*task._samples(normalise_colours(k * raw), task.picture, g)))
            for k, g in ((1.0, torch.Generator().manual_seed(0)), (0.5, torch.Generator().manual_seed(0)))
        )
        assert dark > 0.2 > 3 * same


class TestTask:
    def test_the_contract(self, ball, exemplar):
        threads(1)
        assert_loss_is_pure(Text2MeshTask(CONFIG, exemplar, ball), 1)

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_skipped_step_leaves_no_trace(self, fault, ball, exemplar):
        threads(1)
        assert_third_step_leaves_no_trace(lambda: Text2MeshTask(CONFIG, exemplar, ball), CONFIG, fault)

    def test_options_matter(self, ball, exemplar):
        def value(**options) -> float:
            task = Text2MeshTask(replace(CONFIG, **options), exemplar, ball)
            for name in ("colours.2.weight", "colours.2.bias"):
                task.named[name].data.normal_(generator=torch.Generator().manual_seed(0))
            return float(task.loss(0, torch.Generator().manual_seed(5)).value.detach())

        plain = value()
        for options in (
            *({"sigma": 2.0}, {"views": 3}, {"cameras": "anchored"}, {"fov": 40.0}, {"distance": 3.0}),
            *({"layers": ("relu1_1",)}, {"samples": 32}, {"moment_weight": 1.0}, {"seed": 1}),
            *({"colour_histogram": False}, {"pooling": "average"}),
            *({"frequencies": 9}, {"width": 17}, {"exemplar_size": 64}, {"view": 56}),
        ):
            assert value(**options) != plain, options


def test_waves_are_opened_in_as_many_steps_as_wanted(ball, exemplar):
    """As published: 87; until then a step sees less of them, and afterwards all."""
    assert PRESETS["text-paper"].open_waves == PRESETS["paper"].open_waves == 87
    config = replace(CONFIG, open_waves=8)
    assert [share_open(config, step) for step in (0, 2, 8, 9, None)] == [0, 0.25, 1, 1, 1]

    def values(task) -> list[float]:
        for name in ("colours.2.weight", "colours.2.bias"):
            task.named[name].data.normal_(generator=torch.Generator().manual_seed(0))
        return [float(task.loss(k, torch.Generator().manual_seed(5)).value.detach()) for k in (0, 2, 8)]

    opening, plain = (
        values(Text2MeshTask(config, exemplar, ball)),
        values(Text2MeshTask(CONFIG, exemplar, ball)),
    )
    assert len({*opening}) == 3 and {*plain} == {opening[2]}
    task = shaken(tiny("text2mesh", open_waves=8))
    assert not torch.equal(task.style(2)[0], task.style(8)[0])
    assert torch.equal(task.style(8)[0], task.style()[0])
    first, last = (float(task.loss(k, torch.Generator().manual_seed(5)).value.detach()) for k in (2, 8))
    assert first != last


def test_a_flat_colour_is_learned(tmp_path):
    red = Exemplar({"albedo": np.full((32, 32, 3), (0.8, 0.3, 0.1), np.float32)}, "red")
    settings = SMALL | {"preview_every": 40, "lr": 0.02, "layers": ("relu1_1",)}
    texture = text2mesh.fit(red, icosphere(4), tmp_path / "run", set=settings, steps=40)
    mean = texture.apply().maps["albedo"].mean((0, 1))
    assert mean[0] > mean[1] + 0.1 > mean[2] + 0.2
    assert (tmp_path / "run" / "previews" / "000040.png").is_file()
    assert Text2MeshTexture.load(tmp_path / "run").about["mesh"] == "icosphere4"


def test_the_texture_is_as_fine_as_the_resolution(exemplar):
    for side in (32, 48):
        texture = text2mesh.fit(exemplar, icosphere(4), set=SMALL | {"resolution": side}, steps=1)
        assert texture.image.shape == (side, side, 3)
        assert texture.apply().maps["albedo"].shape == (side, side, 3)


def test_a_texture_of_another_mesh_is_not_applied(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    ball = with_layout(icosphere(4), 32)
    Text2MeshTexture(ball, np.zeros((32, 32, 3), np.float32), {"name": "lava"}).save("lava.safetensors")
    assert main(["apply", "lava.safetensors", "--mesh", "vase", "--out", "a.glb", "--quiet"]) == 2
    assert "this texture belongs to mesh 'icosphere4', not to 'vase'" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["lava.safetensors"]


def test_resuming_changes_nothing(exemplar, tmp_path):
    threads(1)
    text2mesh.fit(exemplar, icosphere(4), tmp_path / "whole", set=SMALL, steps=4)
    text2mesh.fit(exemplar, icosphere(4), tmp_path / "part", set=SMALL, steps=2)
    text2mesh.fit(exemplar, icosphere(4), tmp_path / "part", steps=4, resume=True)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")
    with pytest.raises(CheckpointError, match="mesh"):
        text2mesh.fit(exemplar, icosphere(5), tmp_path / "part", steps=6, resume=True)


def test_from_words_to_a_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    bad_files.text(tmp_path / "cube.obj", bad_files.CUBE)
    settings = "resolution=32 view=32 width=8 frequencies=4 views=1 text_vertices=50 preview_every=2"
    words = f"fit text2mesh --text dots --clip words --mesh cube.obj --quiet --steps 2 --set {settings}"
    assert main(words.split()) == 0
    run = tmp_path / capsys.readouterr().out.strip()
    assert run.name == "dots-cube-text2mesh" and (run / "previews" / "000002.png").is_file()
    assert main(["apply", str(run), "--mesh", "cube.obj", "--out", "cube.glb", "--quiet"]) == 0
    written, learned = Asset.load(tmp_path / "cube.glb"), Text2MeshTexture.load(run)
    assert learned.shape is not None and len(learned.shape.vertices) >= 50
    np.testing.assert_allclose(written.mesh.vertices.max(0), learned.shape.vertices.max(0), atol=1e-5)
    assert np.abs(written.mesh.vertices.max(0) - learned.mesh.vertices.max(0)).max() > 1e-5


class TestRefused:
    @pytest.mark.parametrize(
        ("setting", "message"),
        [
            ("layers=relu9_1", "relu9_1; use some of"),
            ("cameras=inside", "inside"),
            ("exemplar_size=31", "choose 0, or 32 or more"),
            ("view=8", "out of range"),
        ],
    )
    def test_settings(self, setting, message, exemplar, ball):
        with pytest.raises(ConfigError, match=message):
            text2mesh.fit(exemplar, ball, set=[setting])

    @pytest.mark.parametrize(
        ("words", "message"),
        [
            ("", "--exemplar is missing; give --exemplar IMAGE, or --text WORDS"),
            ("--exemplar lava --text red", "--text and --exemplar contradict each other"),
            ("--exemplar lava --clip words", "--clip means nothing without --text"),
            ("--exemplar lava --preset text", "the preset text is for words, not for exemplars"),
            ("--exemplar lava --set text_crops=3", "text_crops means nothing without words; leave it out"),
            ("--text red --clip words --set samples=8", "samples means nothing without an exemplar"),
            ("--text red --preset paper", "the preset paper is for exemplars, not for words"),
            ("--text frobs --clip words", "does not know the word 'frobs'"),
            ("--text red --clip no/folder", "no/folder"),
        ],
    )
    def test_command_lines(self, words, message, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        assert main(f"fit text2mesh --mesh vase --quiet {words}".split()) == 2
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1 and not list(tmp_path.iterdir())

    def test_no_colours(self, ball):
        height = Exemplar({"height": np.zeros((32, 32, 1), np.float32)}, "hills")
        with pytest.raises(ImageError, match="hills has no albedo"):
            text2mesh.fit(height, ball)
