"""Flat pictures by Gram matrices: the loss in closed form, the borders, and a small synthesis."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError, ImageError
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.methods.baselines import gatys
from mitex.methods.baselines.gatys import PRESETS, GatysConfig
from mitex.methods.baselines.gatys.task import GatysTask
from mitex.runtime import threads
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

CONFIG = GatysConfig(steps=4, size=48, exemplar_size=32, layers=("relu1_1", "relu2_1"), preview_every=0)
SMALL = {"size": 48, "exemplar_size": 32, "layers": CONFIG.layers, "checkpoint_every": 4, "preview_every": 0}


def value(task: GatysTask) -> float:
    return float(task.loss(0, torch.Generator()).value.detach())


def test_the_loss_is_that_of_the_paper(exemplar):
    """E = sum over layers of 1 / (4 N^2) sum (G - A)^2, with G divided by the number of places."""
    config = replace(PRESETS["paper"], size=48, exemplar_size=32)
    task = GatysTask(config, exemplar)
    network, expected = Vgg16(), 0.0
    target = torch.from_numpy(exemplar.resized(32).maps["albedo"])
    for layer in config.layers:
        g, a = (
            network.features(picture.detach()[None], [layer])[layer][0].flatten(0, 1)
            for picture in (task.image, target)
        )
        difference = g.T @ g / len(g) - a.T @ a / len(a)
        expected += float(difference.square().sum()) / (4 * g.shape[1] ** 2)
    assert value(task) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("layers", [CONFIG.layers, ("relu1_1", "pool2")])
def test_a_periodic_picture_has_no_borders(layers, exemplar):
    """Shifted around by whole cells of the deepest layer, it is the same picture."""
    for periodic, tolerance in ((True, 1e-5), (False, None)):
        task = GatysTask(replace(CONFIG, periodic=periodic, layers=layers), exemplar)
        before = value(task)
        with torch.no_grad():
            task.image.copy_(task.image.roll((12, 24), (0, 1)))
        if tolerance is None:
            assert abs(value(task) - before) > 1e-4 * before
        else:
            assert value(task) == pytest.approx(before, rel=tolerance)


def test_options_matter(exemplar):
    """Of the loss at the start: `lr` and `optimizer` are the loop's, `resolution` the texture's."""
    plain = value(GatysTask(CONFIG, exemplar))
    numbers = {"size": 64}, {"exemplar_size": 40}, {"noise": 0.4}, {"seed": 1}
    for options in (
        *numbers,
        {"periodic": True},
        {"layers": ("relu1_1",)},
        {"layers": ("relu1_1", "pool1")},
    ):
        assert value(GatysTask(replace(CONFIG, **options), exemplar)) != plain, options


def test_noise_is_the_share_of_white_noise_at_the_start(exemplar):
    mean = exemplar.resized(32).maps["albedo"].mean((0, 1))
    white = GatysTask(replace(CONFIG, noise=1.0), exemplar).image.detach().numpy()
    assert np.histogram(white, 4, (0, 1))[0] / white.size == pytest.approx(0.25, abs=0.03)
    for noise in (0.0, 0.3):
        image = GatysTask(replace(CONFIG, noise=noise), exemplar).image.detach().numpy()
        np.testing.assert_allclose(image, noise * white + (1 - noise) * mean, atol=1e-6)


def test_the_size_on_a_mesh_is_the_resolution_of_the_layout(exemplar):
    """And the optimizer and its step reach the picture."""
    settings = {**SMALL, "resolution": 300}
    plain = gatys.fit(exemplar, set=settings, steps=3)
    assert plain.texels == 300
    for options in ({"lr": 0.05}, {"optimizer": "adam"}):
        other = gatys.fit(exemplar, set={**settings, **options}, steps=3)
        assert not np.array_equal(other.image, plain.image), options


def test_the_contract(exemplar):
    threads(1)
    assert_loss_is_pure(GatysTask(CONFIG, exemplar), 0)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_skipped_step_leaves_no_trace(fault, exemplar):
    threads(1)
    assert_third_step_leaves_no_trace(lambda: GatysTask(CONFIG, exemplar), CONFIG, fault)


@pytest.mark.parametrize("optimizer", ["lbfgs", "adam"])
def test_the_picture_gets_the_exemplar_s_colours(optimizer, exemplar):
    texture = gatys.fit(exemplar, set={**SMALL, "optimizer": optimizer, "lr": 0.1}, steps=40)
    assert texture.image.min() >= 0 and texture.image.max() <= 1 and texture.texels == 512
    target = exemplar.resized(32).maps["albedo"]
    assert np.abs(texture.image.mean((0, 1)) - target.mean((0, 1))).max() < 0.05
    assert texture.about["loss"] < 0.2 * value(GatysTask(CONFIG, exemplar))


def test_resuming_changes_nothing(exemplar, tmp_path):
    threads(1)
    whole = gatys.fit(exemplar, tmp_path / "whole", set=SMALL, steps=8)
    gatys.fit(exemplar, tmp_path / "part", set=SMALL, steps=4)
    part = gatys.fit(exemplar, tmp_path / "part", steps=8, resume=True)
    assert np.array_equal(whole.image, part.image)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")


def test_the_preview_shows_exemplar_and_picture(exemplar):
    task = GatysTask(CONFIG, exemplar)
    picture = task.preview(0)
    assert np.array_equal(picture[:32, :32], exemplar.resized(32).maps["albedo"])
    assert np.array_equal(picture[:, 48:], task.image.detach().numpy())


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("layers=relu9_1", "relu9_1; use some of"),
        ("layers=relu3_4", "relu3_4; use some of"),
        ("layers=", "are none"),
        ("size=40", "multiple of 16"),
        (["size=48", "layers=pool5"], "multiple of 32"),
    ],
)
def test_settings_that_are_refused(setting, message, exemplar):
    with pytest.raises(ConfigError, match=message):
        gatys.fit(exemplar, set=[setting] if isinstance(setting, str) else setting)


def test_no_colours():
    with pytest.raises(ImageError, match="has no albedo"):
        gatys.fit(Exemplar({"height": np.zeros((32, 32, 1), np.float32)}))
