"""Textures from words that move: both losses in one step, and a model that follows fields."""

import json
import math

import numpy as np
import pytest
import torch

from mitex.mesh import icosphere
from mitex.mesh.fields import vector_field
from mitex.methods import nca
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.surfaces import TrainingMesh
from mitex.methods.nca.text.moving import MovingTextTask
from mitex.runtime import threads
from tests.features.clip.folders import write_folder
from tests.methods.nca.text.tiny_text import SETTINGS, MeanColour, config, grown, loss, task

MOVING = ("motion=right", "motion_steps=2", "resolution=32")


def moving(*settings: str) -> MovingTextTask:
    one = MovingTextTask(config(*MOVING, *settings), MeanColour())
    grown(one)
    return one


@pytest.mark.parametrize("estimator", ["advection", "lucas-kanade"])
def test_a_step_has_both_losses(estimator):
    """The motion's once, and with its weight; the pictures' as without a field that cells know of."""
    threads(1)
    one, three = (moving(f"motion_estimator={estimator}", f"motion_weight={w}") for w in (1, 3))
    first, second = (loss(one).metrics for one in (one, three))
    assert first["motion"] > 1e-6 and second["motion"] == pytest.approx(3 * first["motion"], rel=1e-4)
    still = loss(grown(task("resolution=32"))).metrics
    assert first.keys() == still.keys() | {"motion"}


def test_patterns_wider_than_the_surface_are_measured():
    """In views of as many pixels as Lucas and Kanade's method needs."""
    wide = ("views=patch", "density=512", "resolution=48", "motion_estimator=lucas-kanade")
    assert 0 < loss(moving(*wide)).metrics["motion"] < math.inf


def test_a_texture_from_words_learns_to_move(tmp_path):
    """From a still one, as which it starts."""
    threads(1)
    clip, out = write_folder(tmp_path / "clip"), tmp_path / "run"
    settings = [*SETTINGS, "motion_steps=2", "preset=text"]
    still = nca.fit_text("red dots", tmp_path / "still", clip=clip, set=[*settings, "steps=2"])
    first = nca.fit_text(
        "red dots", clip=clip, init=tmp_path / "still", motion="up", set=[*settings, "steps=0"]
    )
    sphere = icosphere(4)
    assert torch.equal(first.grow(sphere, steps=6, field="up", speed=0.0), still.grow(sphere, steps=6))
    carried = still.grow(sphere, steps=6, field="up", speed=0.75)  # in a period half as long
    assert torch.allclose(first.grow(sphere, steps=6, speed=1.5), carried, atol=1e-6)
    nca.fit_text("red dots", out, clip=clip, init=tmp_path / "still", motion="up", set=[*settings, "steps=4"])
    moved = NcaTexture.load(out)
    about = (moved.about[name] for name in ("motion", "text", "parent"))
    assert tuple(about) == ("up", "red dots", "red dots")
    here, there = (moved.grow(sphere, steps=6, field=field) for field in ("about-y", "up"))
    assert (here - there).abs().max() > 1e-6
    metrics = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert any(line.get("motion", 0) > 0 for line in metrics) and "whole" in metrics[-1]


def test_it_learns_to_move_on_a_mesh_of_ones_own(tmp_path):
    """Its field is that of the mesh, along which states are carried."""
    threads(1)
    clip, egg = write_folder(tmp_path / "clip"), icosphere(29)
    egg = egg.with_vertices(egg.vertices * np.array([0.7, 1.2, 0.9], np.float32))
    speeds = "motion_speeds=1.5,1.5"
    one = MovingTextTask(config(*MOVING, speeds, "motion_turns=false"), MeanColour(), None, None, egg)
    (surface,) = one.surfaces
    assert isinstance(surface, TrainingMesh) and np.ptp(surface.mesh.vertices[:, 0]) < 1.3
    assert np.allclose(
        one.field(0, one.field_seeds[0]).vectors, 1.5 * vector_field(surface.mesh, "right"), atol=1e-5
    )
    grown(one)
    assert loss(one).metrics["motion"] > 1e-6
    settings = [*SETTINGS, "motion_steps=2", "preset=text", "steps=2", "density=9"]
    out = tmp_path / "run"
    learned = nca.fit_text("red dots", out, clip=clip, mesh=egg, motion="up", set=settings)
    assert (learned.about["motion"], learned.about["motion_advection"]) == ("up", True)
    sphere = icosphere(4)
    here, there = (learned.grow(sphere, steps=6, field=field) for field in ("about-y", "up"))
    assert (here - there).abs().max() > 1e-6 and torch.equal(there, learned.grow(sphere, steps=6))
