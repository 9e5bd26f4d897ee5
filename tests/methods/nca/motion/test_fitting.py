"""From a field's name to a model that moves."""

import json
import math
import warnings

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError
from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.mesh.fields import vector_field
from mitex.methods import nca
from mitex.methods.nca import Graft, NcaTexture, files, settling
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.growth import grown_state
from mitex.methods.nca.motion.cell_motion import fastest
from mitex.methods.nca.motion.condition import cell_vectors
from mitex.methods.nca.page import contents
from mitex.methods.nca.weights import graft_weights
from mitex.runtime import threads
from tests.methods.nca.tiny import SETTINGS, config, texture
from tests.training.contract import assert_same_checkpoint

TINY = [*SETTINGS, "surfaces=even,flat", "motion_steps=2", "pool=2"]


@pytest.fixture(autouse=True)
def soon_in_order(monkeypatch):
    """How long patterns take to settle is tested elsewhere."""
    monkeypatch.setattr(settling, "STEPS", (1,))
    monkeypatch.setattr(settling, "SIDE", 32)


@pytest.fixture(scope="module")
def lava():
    """With few pixels, since its typical colours are looked for in each fit."""
    return Exemplar({"albedo": Exemplar.load("lava").resized(48).maps["albedo"]}, "lava")


def _parent(tmp_path, **options):
    options = {"hidden": 16, "shape": config().decoder_shape} | options
    return texture(seed=3, **options).save(tmp_path / "parent.safetensors")


def test_a_still_look_learns_to_move(tmp_path, lava):
    """It starts as what it was, with weights for the field, which change then."""
    path = _parent(tmp_path)
    first = nca.fit(lava, init=path, motion="about-y", set=[*TINY, "steps=0"])
    assert (first.about["preset"], first.about["motion"]) == ("motion", "about-y")
    assert first.about["motion_period"] == 6.0 and first.about["parent"] == "tiny"
    assert first.about["motion_speed"] == pytest.approx(2 * 4 / math.pi, rel=0.01)  # the sine's mean: pi / 4
    still = NcaTexture.load(path)
    sphere = icosphere(4)
    assert torch.equal(first.grow(sphere, steps=6, speed=0.0), still.grow(sphere, steps=6))
    uncarried = NcaTexture(first.look, {**first.about, "motion_advection": False})
    assert torch.equal(uncarried.grow(sphere, steps=6, speed=1.5), still.grow(sphere, steps=6))
    assert (first.grow(sphere, steps=6, speed=1.5) - still.grow(sphere, steps=6)).abs().max() > 0.01
    grafted = Graft(still, uncarried, graft_weights(sphere, "0.5"))  # of one family, and alike so far
    state = grown_state(grafted.growth_on(Cells(sphere, 0, sphere), sphere), 0, 6)
    assert torch.allclose(state, still.grow(sphere, steps=6), atol=1e-6)
    out = tmp_path / "run"
    moving = nca.fit(lava, out, init=path, motion="about-y", set=[*TINY, "steps=8"])
    again = NcaTexture.load(out)
    for look in (moving, again):
        here, there = (look.grow(sphere, steps=6, field=field) for field in ("about-y", "up"))
        assert (here - there).abs().max() > 1e-5
    metrics = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert any(line.get("motion", 0) > 0 for line in metrics)


def test_a_run_is_resumed_with_its_field(tmp_path, lava):
    """And is the run that was not interrupted."""
    threads(1)
    settings = [*TINY, "checkpoint_every=2"]
    nca.fit(lava, tmp_path / "whole", motion="up", set=[*settings, "steps=5"])
    nca.fit(lava, tmp_path / "parts", motion="up", set=[*settings, "steps=3"])
    nca.fit(lava, tmp_path / "parts", set=["steps=5"], resume=True)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "parts")
    with pytest.raises(CheckpointError, match="motion"):
        nca.fit(lava, tmp_path / "parts", motion="down", set=["steps=6"], resume=True)


def test_a_pattern_keeps_its_size_when_it_learns_to_move(tmp_path, lava):
    """Unless another one is asked for; a still texture from the same parent has its own preset's."""
    parent = texture(seed=3, hidden=16, shape=config().decoder_shape)
    path = NcaTexture(parent.look, {**parent.about, "density": 10.0}).save(tmp_path / "parent.safetensors")
    words = [word for word in (*TINY, "steps=0") if not word.startswith("density")]
    for motion, preset in (("up", None), (None, "motion"), ("up", "patch")):
        moving = nca.fit(lava, init=path, motion=motion, preset=preset, set=words)
        assert moving.about["density"] == 10
    assert nca.fit(lava, init=path, motion="up", set=[*words, "density=9"]).about["density"] == 9
    assert nca.fit(lava, init=path, set=words).about["density"] == 32
    assert nca.fit(lava, motion="up", set=words).about["density"] == 32


def test_another_preset_may_move_too(lava):
    words = [*TINY, "steps=0"]
    for preset, settings in (("patch", words), (None, [*words, "preset=patch"])):
        learned = nca.fit(lava, motion="up", preset=preset, set=settings)
        assert (learned.about["preset"], learned.look.rule.condition) == ("patch", 3)


@pytest.mark.parametrize(
    ("motion", "problem"),
    [
        ("rihgt", "did you mean right"),
        ("1,0", "no direction"),
        ("0,0,0", "zero everywhere"),
        ("wind.npy", "one mesh"),
        ("wind.PLY", "one mesh"),
        ("strokes.json", "one mesh"),
        ("", "'' is no field to move along; leave out `motion`"),
        ("None", "'None' is no field to move along"),
    ],
)
def test_fields_that_nothing_can_be_trained_with(tmp_path, monkeypatch, lava, motion, problem):
    (tmp_path / "strokes.json").write_text('{"strokes": [[[0, 0, 1], [0, 0.5, 0.8]]]}')
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=problem):
        nca.fit(lava, tmp_path / "run", motion=motion, set=TINY)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("estimator", ["flow", "lucas-kanade"])
def test_motion_in_pictures_needs_an_albedo(tmp_path, estimator):
    """Without one, states alone can tell it."""
    heights = Exemplar({"height": np.random.default_rng(0).random((64, 64, 1), np.float32)}, "heights")
    words = [*TINY, "steps=0"]
    with pytest.raises(ConfigError, match="of the albedo, which the exemplar does not have; add one, or set"):
        nca.fit(heights, tmp_path / "run", motion="up", set=[*words, f"motion_estimator={estimator}"])
    assert not (tmp_path / "run").exists()
    assert nca.fit(heights, motion="up", set=[*words, "motion_estimator=advection"]).look.maps == ("height",)


def test_a_run_that_is_stopped_knows_its_field(tmp_path, lava):
    """It is read from its checkpoint, and moves as the texture that is trained to the end."""
    out, settings = (
        tmp_path / "run",
        [*TINY, "steps=3", "motion_speeds=0,1.5", "motion_period=5", "density=9"],
    )
    whole = nca.fit(lava, out, motion="about-y", set=settings)
    (out / files.NAME).unlink()
    stopped = NcaTexture.load(out)
    for key in ("motion", "motion_period", "motion_advection", "motion_speed", "density", "preset"):
        assert stopped.about[key] == whole.about[key], key
    sphere = icosphere(4)
    assert torch.equal(stopped.grow(sphere, steps=4), whole.grow(sphere, steps=4))
    assert contents([out], [sphere]).data["field"] == "about-y"


def test_a_parent_must_fit_but_for_the_condition(tmp_path, lava):
    with pytest.raises(CheckpointError, match="differs from the config in rule.fc1"):
        nca.fit(lava, init=_parent(tmp_path, hidden=8), motion="up", set=TINY)
    with pytest.raises(CheckpointError, match="differs from the config in rule.fc1.weight"):
        nca.fit(lava, init=_parent(tmp_path, condition=3), set=TINY)
    moving = nca.fit(lava, init=_parent(tmp_path, condition=3), motion="up", set=[*TINY, "steps=0"])
    assert moving.about["parent"] == "tiny"


def test_it_follows_its_own_field_at_the_speed_of_its_training(tmp_path, lava):
    """On a sphere, half of the field is longer than its mean; the training told the cells all of it."""
    settings = [*TINY, "steps=0", "motion_speeds=1,1"]
    texture = nca.fit(lava, init=_parent(tmp_path), motion="right", set=settings)
    sphere = icosphere(12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told = cell_vectors(sphere, sphere, "right", 1.0, longest=fastest(texture.about))
    assert np.allclose(told, vector_field(sphere, "right"), atol=0.01)
