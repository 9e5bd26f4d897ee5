"""Every key of a training from words does what it says: each check fails where its key is ignored."""

from dataclasses import fields

import numpy as np
import pytest
import torch

from mitex.methods.nca import NcaConfig
from mitex.methods.nca.text.task import TextTask
from tests.methods.nca.text.tiny_text import grown, task


@pytest.fixture(scope="module")
def build():
    """A task with some settings; the same task for the same settings."""
    tasks: dict[tuple[str, ...], TextTask] = {}

    def build(*settings: str) -> TextTask:
        if settings not in tasks:
            tasks[settings] = grown(task(*settings))
        return tasks[settings]

    return build


def _terms(one, seed=0):
    terms = one.terms(one.surfaces[0], one.pool[0], torch.Generator().manual_seed(seed))
    return {name: term.item() for name, term in terms.items()}


def _spread(augmentation):
    """How far the corners of what is seen are moved, at most."""
    corners = torch.tensor([[-1.0, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
    moved = corners @ augmentation.homography.transpose(1, 2)
    return (moved[..., :2] / moved[..., 2:]).abs().max().item()


def _sight(one):
    return one.banks[one.meshes[0]].sight(0)


CHECKS = {}


def check(function):
    CHECKS[function.__name__] = function
    return function


@check
def text(build):
    red, green = build("text=red"), build("text=green")
    assert red.words.text[0] > green.words.text[0] and red.words.text[1] < green.words.text[1]


@check
def text_directional(build):
    """Without it the distance is that of the pictures themselves, whatever the grey sphere looks like."""
    one = build("text_directional=false")
    surface, generator = one.meshes[0], torch.Generator().manual_seed(0)
    sight = one.banks[surface].sight(int(torch.randint(one.config.text_bank, (), generator=generator)))
    views = one.figures[surface].textured(one.look, one.pool[0], sight.cameras)
    (pictures,) = one.words.directions([sight.whole(views.coloured, one.words.model.resolution)])
    assert _terms(one)["whole"] == pytest.approx(1 - (pictures @ one.words.text).item())
    assert _terms(one)["whole"] != pytest.approx(_terms(build())["whole"])


@check
def text_object(build):
    one = build("text_object=torus")
    assert one.metadata()["text"] == "an image of a torus made of red"


@check
def text_prompt(build):
    assert build("text_prompt={text} {object}").metadata()["text"] == "red a sphere"


@check
def text_bank(build):
    negatives = set()
    for seed in range(12):
        one = build("text_bank=2")
        _terms(one, seed)
        negatives = set(one.banks[one.meshes[0]]._negatives)
    assert negatives == {0, 1}


@check
def text_distances(build):
    one = build("text_distances=2,4", "text_bank=8")
    bank = one.banks[one.meshes[0]]
    distances = {round(float(np.linalg.norm(bank.sight(k).cameras.origin[0])), 3) for k in range(8)}
    assert distances == {2.0, 4.0}


@check
def text_crops(build):
    assert len(_sight(build("text_crops=3")).close.picture) == 6


@check
def text_crop_area(build):
    assert _sight(build("text_crop_area=0.04")).close.side == pytest.approx(0.2)


@check
def text_tilt(build):
    assert _spread(_sight(build("text_tilt=0")).whole) == pytest.approx(1.0, abs=1e-5)
    assert 1.2 < _spread(_sight(build("text_tilt=1")).whole) <= 2


def _weight(key, name):
    def function(build):
        one, three = (_terms(build(f"{key}={weight}", "text_roughness=0")) for weight in (1, 3))
        assert three[name] == pytest.approx(3 * one[name], rel=1e-4) and one[name] > 1e-6
        none = _terms(build(f"{key}=0"))
        assert none.get(name, 0.0) == 0

    CHECKS[key] = function


_weight("text_whole_weight", "whole")
_weight("text_close_weight", "close")
_weight("text_relief_weight", "relief")
_weight("text_smooth_weight", "rough")


@check
def text_range_weight(build):
    wide = [build(f"text_range_weight={weight}", "decoder=false") for weight in (1, 3)]
    for one in wide:
        one.pool[0, 0] = 20.0
    first, second = (_terms(one)["range"] for one in wide)
    assert second == pytest.approx(3 * first, rel=1e-4) and first > 1e-6


@check
def text_relief(build):
    bounds = [build(f"text_relief={bound}").figures for bound in (1, 3)]
    one, three = (next(iter(figures.values())).relief.bound for figures in bounds)
    assert three == pytest.approx(3 * one)


@check
def text_roughness(build):
    one, other = (_terms(build(f"text_roughness={xi}"))["rough"] for xi in (0, 0.02))
    assert one - other == pytest.approx(0.02, abs=1e-5)


@pytest.mark.parametrize("key", sorted(CHECKS))
def test_the_check_of_a_key_holds(build, key):
    CHECKS[key](build)


@pytest.mark.parametrize("key", sorted(CHECKS))
def test_the_check_of_a_key_fails_where_it_is_ignored(build, key):
    def without_key(*settings: str) -> TextTask:
        return build(*(setting for setting in settings if not setting.startswith(f"{key}=")))

    with pytest.raises(AssertionError):
        CHECKS[key](without_key)


def test_no_key_is_left_out():
    keys = {field.name for field in fields(NcaConfig) if field.name.partition("_")[0] == "text"}
    assert keys == set(CHECKS) | {"text_growth_steps", "text_model", "text_parent"}  # test_fitting
