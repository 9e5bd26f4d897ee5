"""Textures of one mesh from words: the loss by hand, what each setting does, and what is refused."""

from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError, WeightsError
from mitex.exemplar import Exemplar
from mitex.losses import directional_distance, mean_direction
from mitex.mesh import icosphere
from mitex.methods import surface
from mitex.methods.layout import with_layout
from mitex.methods.surface.config import PRESETS, SurfaceConfig
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.task import SurfaceTask
from mitex.methods.surface.texture import SurfaceTexture
from mitex.methods.surface.words import Words
from mitex.runtime import threads
from mitex.training import resolve, train
from mitex.training.config import by_key
from tests.methods.nca.text.tiny_text import MeanColour
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

pytestmark = pytest.mark.usefixtures("own_cache", "known_exemplars")
SMALL = (
    *("resolution=32", "exemplar_size=32", "steps=4", "scales=1", "layers=relu1_1,relu2_1", "diffusion=0.01"),
    *("checkpoint_every=2", "preview_every=0", "content_layer=relu2_1", "text_object=sphere"),
    *("text_bank=3", "text_views=2", "text_view=24", "text_crops=2"),
)
BALL = with_layout(icosphere(3), 32)
# Of three sets of views, by a generator with the seed 5.
DRAWN = int(torch.randint(3, (), generator=torch.Generator().manual_seed(5)))
RED = np.array([0.9, 0.1, 0.1], np.float32)


@pytest.fixture(autouse=True)
def one_thread():
    threads(1)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("words") / "run"
    fit("red dots", folder)
    return folder


@cache
def exemplar() -> Exemplar:
    return Exemplar({"albedo": Exemplar.load("cobblestone").resized(32).maps["albedo"]}, "cobblestone")


@cache
def domain(scales: int = 1) -> SurfaceDomain:
    return SurfaceDomain.of(BALL, config(f"scales={scales}"), keep=False)


def config(*settings: str, text: str = "red") -> SurfaceConfig:
    return resolve(PRESETS, "text", None, [*SMALL, f"text={text}", *settings])


def task(*settings: str, image: bool = False, content: bool = False, text: str = "red") -> SurfaceTask:
    one = config(*settings, text=text)
    on = domain(one.scales)
    kept = np.tile(RED, (len(on.texels.index), 1)) if content else None
    return SurfaceTask(one, exemplar() if image else None, on, kept, words=Words(one, MeanColour(), on))


def seen(one: SurfaceTask) -> Words:
    assert one.words is not None
    return one.words


def value(one: SurfaceTask, step: int = 3, seed: int = 0) -> float:
    return float(one.loss(step, torch.Generator().manual_seed(seed)).value.detach())


def words_cost(one: SurfaceTask, colours: torch.Tensor) -> float:
    """What the words cost in a step with the seed of `value`."""
    generator = torch.Generator().manual_seed(0)
    one._draw_triples(3, generator)
    return sum(term.item() for term in seen(one).terms(colours.detach(), generator).values())


class TestFigure:
    def test_grey_texels_are_the_bare_mesh(self):
        one = task()
        cameras, grey = seen(one).bank.sight(0).cameras, torch.full((len(one.coordinates), 3), 0.5)
        assert torch.allclose(
            seen(one).figure.textured(cameras, grey), seen(one).figure.bare(cameras), atol=1e-6
        )

    def test_texels_are_seen_where_they_lie(self):
        """Colours that are places, of which shading leaves the ratios."""
        one = task("text_background=0", "text_distance=3", "text_view=48")
        cameras, place = seen(one).bank.sight(0).cameras, torch.tensor(one.levels.position)
        picture = seen(one).figure.textured(cameras, (0.5 + 0.4 * place).float())
        hit = picture.sum(3) > 0
        origin, direction = (torch.tensor(rays) for rays in cameras.rays())
        along = -(origin * direction).sum(3)
        depth = along - (along.square() - origin.square().sum(3) + 1).clamp(min=0).sqrt()
        expected = 0.5 + 0.4 * (origin + depth[..., None] * direction)
        ratios = (p[hit] / p[hit].sum(1, keepdim=True) for p in (picture, expected))
        assert hit.any(dim=(1, 2)).all() and torch.sub(*ratios).abs().median() < 0.01

    def test_gradients_are_those_of_finite_differences(self):
        one = task()
        generator = torch.Generator().manual_seed(0)
        colours, way = torch.rand(2, len(one.coordinates), 3, generator=generator)
        weights = torch.rand(2, 24, 24, 3, generator=generator)

        def total(scale: torch.Tensor) -> torch.Tensor:
            return (
                seen(one).figure.textured(seen(one).bank.sight(0).cameras, colours + scale * way) * weights
            ).sum()

        (slope,) = torch.autograd.grad(total(scale := torch.zeros((), requires_grad=True)), scale)
        with torch.no_grad():
            difference = (total(torch.tensor(1e-2)) - total(torch.tensor(-1e-2))) / 2e-2
        assert slope.item() == pytest.approx(difference.item(), rel=1e-3)


class TestLoss:
    def test_the_terms_are_those_of_the_paper(self):
        """MeshNCA's equations 7 to 9, picture by picture."""
        one = task("text_close_weight=2")
        sight, figure, model = seen(one).bank.sight(DRAWN), seen(one).figure, MeanColour()
        texts = model.encode_texts(["an image of a sphere made of red", "sphere"])
        pictures, bare = figure.textured(sight.cameras, one.values), figure.bare(sight.cameras)

        def distance(cut):
            sides = [cut(side, 16) for side in (pictures, bare)]
            means = [mean_direction(torch.cat([model.encode_images(p[None]) for p in s])) for s in sides]
            return directional_distance(*means, *texts).item()

        terms = seen(one).terms(one.values.detach(), torch.Generator().manual_seed(5))
        assert terms["whole"].item() == pytest.approx(distance(sight.whole), abs=1e-5)
        assert terms["close"].item() == pytest.approx(2 * distance(sight.close), abs=1e-5)
        assert value(one) == pytest.approx(words_cost(one, one.values), abs=1e-5)

    def test_words_see_the_means_of_groups_on_a_coarse_scale(self):
        one = task()
        group = torch.from_numpy(one.levels.groups(1))
        means = torch.stack([one.values[group == k].mean(0) for k in range(int(group.max()) + 1)])
        assert 3 < len(group) / len(means) < 5 and one.scale(0) == 1
        assert value(one, 0) == pytest.approx(words_cost(one, means[group]), abs=1e-5)
        assert value(one, 0) != pytest.approx(value(one, 3), abs=1e-5)

    def test_words_come_beside_the_exemplar(self):
        """Weighed by what the exemplar costs a surface without features."""
        without, one, two = (value(task(f"text_weight={weight}", image=True)) for weight in (0, 1, 2))
        assert two - one == pytest.approx(one - without, rel=1e-3)
        plain = task(image=True)
        size = plain.comparisons[0].sizes[0].item()
        assert one - without == pytest.approx(size * words_cost(plain, plain.values), rel=1e-3)

    def test_words_come_beside_the_content(self):
        """At the start the content costs nothing, on no scale; then it does."""
        one = task("text_weight=0", content=True)
        assert np.abs(one.in_texel_order() - RED).max() < 1e-5
        assert value(one, 0) == pytest.approx(0, abs=1e-3) and value(one, 3) == pytest.approx(0, abs=1e-3)
        with torch.no_grad():
            one.coordinates[::2] += 2.0
        assert value(one) > 1
        assert value(task("text_weight=1", content=True)) > 1

    def test_steps_cost_what_they_look_at(self):
        alone, both = task(), task(image=True)
        assert alone.cost(0) == alone.cost(3) == 1
        assert both.cost(3) - both.cost(0) == pytest.approx(0.75) and both.cost(0) > 1

    def test_negatives_are_computed_once(self):
        one, again = task(), task()
        first = seen(one).bank.negative(1)
        assert seen(one).bank.negative(1) is first
        assert torch.equal(first.close, seen(again).bank.negative(1).close)
        assert not torch.equal(first.close, seen(one).bank.negative(2).close)

    @pytest.mark.parametrize("options", [{}, {"image": True}, {"content": True}])
    def test_the_contract(self, options):
        assert_loss_is_pure(task(**options), 1)

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_skipped_step_leaves_no_trace(self, fault):
        assert_third_step_leaves_no_trace(task, config(), fault)


def test_a_colour_is_learned():
    for text, channel in (("red", 0), ("green", 1)):
        one = task("steps=25", text=text)
        train(one, one.config, None, lr=0.3)
        change = (one.in_texel_order().mean(0) - 0.5).tolist()
        assert change[channel] > 0.1 + max(change[k] for k in range(3) if k != channel), (text, change)


# another value of a setting, and what else both tasks are given
CASES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("text_directional=false", ()),
    ("text_prompt=red {text}", ("text=green",)),
    ("text_object=torus", ()),
    ("text_bank=1", ()),
    ("text_views=3", ()),
    ("text_view=40", ()),
    ("text_distance=3", ()),
    ("text_width=0.5", ()),
    ("scale=0.5", ("text_width=0.5",)),
    ("text_background=0.3", ()),
    ("text_crops=3", ()),
    ("text_crop_area=0.3", ()),
    ("text_tilt=0", ()),
    ("text_whole_weight=2", ()),
    ("text_close_weight=0", ()),
    ("seed=1", ()),
)


def test_every_setting_has_a_case():
    names = {field.name for field in fields(SurfaceConfig) if field.name.partition("_")[0] == "text"}
    elsewhere = {"text", "text_weight", "text_model"}  # learned, beside an exemplar, and TestFit
    assert names == elsewhere | {setting.partition("=")[0] for setting, _ in CASES} - {"scale", "seed"}


@pytest.mark.parametrize(("setting", "base"), CASES)
def test_settings_matter(setting, base):
    """Of a texture with a pattern, else a mean colour does not depend on the view."""

    def patterned(*settings: str) -> float:
        one = task(*settings)
        with torch.no_grad():
            one.coordinates.copy_(2.5 * torch.sin(7 * torch.tensor(one.levels.position)))
        return value(one, seed=1)

    assert patterned(*base, setting) != pytest.approx(patterned(*base), abs=1e-6)


def fit(text: str, out: Path | None = None, steps: int = 4, **options: Any) -> SurfaceTexture:
    """A small fit, with the model that ships if no other is named."""
    words = {"text_prompt": "{text}", "text_directional": "false", "steps": str(steps)}
    settings = by_key(SMALL) | words | by_key(options.pop("set", []))
    mesh = options.pop("mesh", icosphere(3))
    given: dict[str, Any] = {"clip": "words", "set": settings, **options}
    return surface.fit_text(text, mesh, out, **given)


class TestFit:
    def test_resuming_changes_nothing(self, tmp_path):
        one: dict[str, Any] = {"set": ["scales=0"]}  # when a scale begins follows from the number of steps
        whole = fit("red dots", tmp_path / "whole", **one)
        fit("red dots", tmp_path / "part", steps=2, **one)
        fit("red dots", tmp_path / "part", resume=True, **one)
        assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")
        again = SurfaceTexture.load(tmp_path / "whole")
        assert again.maps == ("albedo",) and np.abs(again.values - whole.values).max() < 1e-3
        assert again.about["text"] == again.about["name"] == "red dots"
        assert (again.about["preset"], again.about["text_model"]) == ("text-words", whole.about["text_model"])

    @pytest.mark.parametrize(
        ("text", "options", "problem"),
        [
            ("blue dots", {}, "not 'blue dots'"),
            ("red dots", {"exemplar": exemplar()}, "exemplar"),
            ("red dots", {"content": "ao"}, "content"),
            ("red dots", {"mesh": icosphere(4)}, "mesh"),
        ],
    )
    def test_what_a_run_cannot_be_resumed_with(self, run, text, options, problem):
        with pytest.raises(CheckpointError, match=problem):
            fit(text, run, steps=6, resume=True, **options)

    def test_exemplar_and_content_matter(self):
        options: tuple[dict[str, Any], ...] = ({}, {"exemplar": exemplar()}, {"content": "ao"})
        alone, *others = (fit("red dots", steps=1, **given).values for given in options)
        assert all(np.isfinite(v).all() and np.abs(v - alone).max() > 1e-3 for v in others)

    @pytest.mark.parametrize("scale", [0.05, 20])
    def test_words_alone_have_no_exemplar_that_could_be_too_narrow_or_wide(self, scale):
        texture = fit("red dots", steps=1, set=[f"scale={scale}", "text_width=0.05"])
        assert np.isfinite(texture.values).all() and texture.about["steps"] == 1

    @pytest.mark.parametrize(
        ("text", "options", "error", "problem"),
        [
            ("crimson frobs", {}, ConfigError, "does not know the word 'frobs'"),
            (" ", {}, ConfigError, "the text is empty"),
            ("red " * 10_000, {}, ConfigError, "a text of 10000 words; say it in 16 at most"),
            ("red", {"clip": "no/such/folder"}, WeightsError, "no/such/folder"),
            ("red", {"preset": "fast"}, ConfigError, "the preset fast is for exemplars, not for words"),
            ("red", {"orientation": np.ones((92, 3), np.float32)}, ConfigError, "give `exemplar` too"),
            ("red", {"scale_map": np.ones(92, np.float32)}, ConfigError, "give `exemplar` too"),
            (
                "red",
                {"exemplar": Exemplar({"height": np.ones((32, 32, 1), np.float32)})},
                ConfigError,
                "no albedo",
            ),
            (
                "red",
                {"set": ["scale=0.5", "text_width=0"]},
                ConfigError,
                "0.5 changes nothing without an exem",
            ),
            (
                "red",
                {"exemplar": exemplar(), "set": ["scale=0.05", "text_width=0.5"]},
                ConfigError,
                "texels wide with a scale of 0.05",
            ),
            ("red", {"set": ["optimizer=lbfgs", "scales=0"]}, ConfigError, "adam for words"),
            ("red", {"set": ["text_prompt=stone"]}, ConfigError, "leaves out the text"),
            ("red", {"set": ["text_whole_weight=0", "text_close_weight=0"]}, ConfigError, "are all 0"),
        ],
    )
    def test_bad_input_leaves_nothing_behind(self, text, options, error, problem, tmp_path: Path):
        with pytest.raises(error, match=problem):
            fit(text, tmp_path / "run", **options)
        assert not (tmp_path / "run").exists()

    def test_settings_for_words_are_refused_for_an_exemplar(self):
        with pytest.raises(ConfigError, match="the settings are for words, not for an exemplar"):
            surface.fit(exemplar(), icosphere(3), preset="text")
