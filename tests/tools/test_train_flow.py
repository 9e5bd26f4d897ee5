"""The flow network's training: pairs whose motion is what they say, and the way to a file of weights."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors import safe_open
from scipy import ndimage

from mitex.features.flow import flow_network
from mitex.features.flow.warping import warp

TOOLS = Path(__file__).parents[2] / "tools"
TEXTURES = ndimage.gaussian_filter(np.random.default_rng(0).random((3, 64, 64)), (0, 5, 5), mode="wrap")
TEXTURES = ((TEXTURES - TEXTURES.min()) / np.ptp(TEXTURES)).astype(np.float32)


@pytest.fixture
def tool(monkeypatch):
    """Imports a module of the folder of tools."""
    monkeypatch.syspath_prepend(str(TOOLS))
    for name in ("flow_errors", "flow_pairs", "flow_textures", "train_flow"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return import_module


def test_the_second_frame_moved_back_is_the_first(tool):
    pairs = (
        tool("flow_pairs").PairMaker(TEXTURES, 48, changes=False).draw(16, torch.Generator().manual_seed(0))
    )
    back = warp(pairs.frames[:, 1:], pairs.motion)[:, 0]
    inside = slice(8, -8)
    difference = ((back - pairs.frames[:, 0]) * (pairs.mask == 1))[:, inside, inside].abs().amax((1, 2))
    still = ((pairs.frames[:, 1] - pairs.frames[:, 0]) * (pairs.mask == 1)).abs().amax((1, 2))
    discs = pairs.mask.amin((1, 2)) < 1
    assert difference[~discs].max() < 0.03 and still[~discs].max() > 0.3
    speed = pairs.motion.norm(dim=1).amax((1, 2))
    assert speed.max() <= 4.001 and speed.min() < 0.5
    assert 0 < discs.sum() < 16


def test_a_changing_look(tool):
    maker = tool("flow_pairs").PairMaker
    plain, changing = (
        maker(TEXTURES, 48, changes).draw(16, torch.Generator().manual_seed(0)).frames
        for changes in (False, True)
    )
    assert changing.min() >= 0 and changing.max() <= 1
    means = (changing[:, 1].mean((1, 2)) - changing[:, 0].mean((1, 2))).abs()
    assert means.mean() > 3 * (plain[:, 1].mean((1, 2)) - plain[:, 0].mean((1, 2))).abs().mean()


def test_the_kinds_that_judge_are_others_than_those_that_are_learned(tool):
    kinds = tool("flow_textures")
    assert not {*kinds.TRAINED.exemplars} & {*kinds.HELD_OUT.exemplars}
    assert not {*kinds.TRAINED.patterns} & {*kinds.HELD_OUT.patterns}


def test_bubbles_go_on_over_the_borders(tool):
    image = tool("flow_textures").bubbles(np.random.default_rng(0))
    steps = [np.abs(np.roll(image, -1, axis) - image) for axis in (0, 1)]
    assert image.shape == (1024, 1024) and image.std() > 0.1
    assert steps[0][-1].mean() < 2 * steps[0].mean() and steps[1][:, -1].mean() < 2 * steps[1].mean()


@pytest.fixture(scope="module")
def other_textures():
    """Of the kinds that judge."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TOOLS))
        kinds = import_module("flow_textures")
        patch.delitem(sys.modules, "flow_textures")
    return kinds.textures(kinds.HELD_OUT)


@pytest.mark.parametrize("changes", [False, True])
def test_the_network_that_ships_meets_its_targets_on_other_textures(
    tool, changes, other_textures, monkeypatch
):
    """Errors under 0.3 px up to 2 px, and under 10 degrees and a tenth of the speed from half a pixel on."""
    errors = tool("flow_errors")
    monkeypatch.setattr(errors, "textures", {errors.HELD_OUT: other_textures}.__getitem__)
    by_octave = errors.by_octave(flow_network(), errors.held_out(changes))
    fast = [one for low, one in zip(errors.OCTAVES, by_octave, strict=False) if low >= 0.5]
    assert max(one.end_point for one in by_octave) < 0.3 and len(fast) == 3
    assert max(one.direction for one in fast) < 10
    assert all(0.9 < one.speed_ratio < 1.1 for one in fast)


def test_from_textures_to_a_file_of_weights(tool, monkeypatch, tmp_path, capsys):
    script, errors = tool("train_flow"), tool("flow_errors")
    monkeypatch.setattr(script, "textures", lambda kinds: TEXTURES)
    monkeypatch.setattr(errors, "textures", lambda kinds: TEXTURES)
    monkeypatch.setattr(errors, "COUNT", 16)
    monkeypatch.setattr(errors, "SIDE", 48)
    monkeypatch.setattr(script, "FOLDER", tmp_path)
    for steps in (1, 2):
        script.learn(tmp_path / "run", script.Config(steps=steps, batch=1, side=32), resume=steps == 2)
    script.finish(tmp_path / "run")
    printed = capsys.readouterr().out
    assert printed.count("| speed [px] | network | Lucas-Kanade | no motion |") == 2
    assert printed.count("| 1 to 2 | ") == 2 and "look: changing" in printed
    with safe_open(tmp_path / "flow.safetensors", "pt") as file:
        assert file.metadata()["training_steps"] == "2"
        assert len(list(file.keys())) == 18
