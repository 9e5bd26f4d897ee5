"""The whole way from an exemplar to a model file, as small as it can be."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError, OutputError
from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods import nca
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.look import weights_key
from mitex.runtime import threads
from tests.methods.nca.tiny import SETTINGS, config, texture

pytestmark = pytest.mark.usefixtures("quick_settling")


def _losses(folder):
    return [json.loads(line)["appearance"] for line in (folder / "metrics.jsonl").read_text().splitlines()]


@pytest.fixture(scope="module")
def lava():
    """With few pixels, since its typical colours are looked for in each fit."""
    return Exemplar({"albedo": Exemplar.load("lava").resized(48).maps["albedo"]}, "lava")


@pytest.fixture(scope="module")
def run(tmp_path_factory, lava):
    """A real training of 40 steps on the albedo of an embedded exemplar."""
    out = tmp_path_factory.mktemp("fit") / "run"
    always_from_the_seed = ["pool=1", "inject_every=1", "min_steps=8", "max_steps=8"]
    settings = [*SETTINGS, *always_from_the_seed, "steps=40", "preview_every=20", "checkpoint_every=20"]
    return out, nca.fit(lava, out, set=settings)


def test_it_learns(run):
    losses = _losses(run[0])
    assert len(losses) == 40
    assert np.mean(losses[-5:]) < 0.6 * np.mean(losses[:5])


def test_the_run_folder_is_complete(run):
    names = {path.name for path in run[0].iterdir()}
    assert {
        "config.toml",
        "checkpoint.safetensors",
        "metrics.jsonl",
        "texture.safetensors",
        "previews",
    } <= names
    assert [p.name for p in sorted((run[0] / "previews").iterdir())] == ["000020.png", "000040.png"]


def test_the_model_works_on_another_mesh(run):
    out, result = run
    assert result.look.maps == ("albedo",)
    assert result.about["name"] == "lava" and result.about["steps"] == 40
    assert result.about["preset"] == "patch"
    assert 0 < result.about["loss"] < 1e3 and result.about["seconds"] >= 0
    sphere, options = icosphere(6), {"steps": 10, "subdivide": 0, "resolution": None}
    grown = result.apply(sphere, **options).vertex_maps["albedo"]
    for source in (out, out / "texture.safetensors"):
        again = NcaTexture.load(source)
        assert again.about == result.about | {"maps": ["albedo"]}
        assert np.array_equal(again.apply(sphere, **options).vertex_maps["albedo"], grown)
    assert grown.std() > 0.003


def test_a_finished_run_is_not_overwritten(run):
    with pytest.raises(OutputError):
        nca.fit("lava", run[0], set=SETTINGS)


def test_starting_from_a_parent(tmp_path, lava):
    parent = texture(seed=3, hidden=16, shape=config().decoder_shape)
    path = parent.save(tmp_path / "parent.safetensors")
    child = nca.fit(lava, tmp_path / "run", init=path, set=[*SETTINGS, "steps=0"])
    assert child.about["parent"] == "tiny"
    assert "loss" not in child.about  # there was no step
    own, others = (t.look.state_dict() for t in (child, parent))
    assert own.keys() == others.keys() and all(torch.equal(own[name], others[name]) for name in own)


def test_a_family_goes_on_in_runs_that_are_resumed_and_in_grandchildren(tmp_path, lava):
    """It is that of the first ancestor, as its weights were when others were trained from it."""
    parent = texture(seed=3, hidden=16, shape=config().decoder_shape)
    path, run = parent.save(tmp_path / "parent.safetensors"), tmp_path / "run"
    family = weights_key(parent.look)
    nca.fit(lava, run, init=path, set=[*SETTINGS, "steps=1"])
    resumed = nca.fit(lava, run, set=["steps=2"], resume=True)
    assert (resumed.about["parent"], resumed.about["family"]) == ("tiny", family)
    grandchild = nca.fit(lava, tmp_path / "another", init=run, set=[*SETTINGS, "steps=0"])
    assert grandchild.about["family"] == family != weights_key(resumed.look)
    assert NcaTexture.load(path).about["family"] == family


@pytest.mark.parametrize(
    ("parent", "problem"),
    [
        ({"hidden": 8}, "fc1.weight"),
        ({"hidden": 16, "shape": None}, r"decoder\.network"),
        ({"hidden": 16, "shape": DecoderShape(width=13)}, r"decoder\.network"),
        ({"hidden": 16, "maps": ("albedo", "height")}, "maps"),
        ({"hidden": 16, "maps": ("normal",)}, "maps"),
    ],
)
def test_a_parent_of_another_shape(tmp_path, lava, parent, problem):
    path = texture(**({"shape": config().decoder_shape} | parent)).save(tmp_path / "parent.safetensors")
    with pytest.raises(CheckpointError, match=problem):
        nca.fit(lava, tmp_path / "run", init=path, set=SETTINGS)
    assert not (tmp_path / "run").exists()


def test_a_parent_whose_decoder_reads_something_else(tmp_path, lava):
    """Weights of the same shapes, but other waves, or another interpolation."""
    for changes in ({"frequencies": (1.0,)}, {"interpolation": "linear"}, {"omega": 3.0}):
        shape = replace(config().decoder_shape, **changes)
        path = texture(hidden=16, shape=shape).save(tmp_path / "parent.safetensors")
        with pytest.raises(CheckpointError, match=next(iter(changes))):
            nca.fit(lava, tmp_path / "run", init=path, set=SETTINGS)


def test_resuming_takes_the_settings_of_the_run(tmp_path):
    threads(1)
    out = tmp_path / "run"
    first = nca.fit("wicker", out, set=[*SETTINGS, "steps=2"])
    second = nca.fit("wicker", out, set=["steps=3"], resume=True)
    assert (first.about["steps"], second.about["steps"]) == (2, 3)
    assert second.look.rule.hidden == 16 and len(_losses(out)) == 3
    with pytest.raises(CheckpointError, match="frequency"):
        nca.fit("wicker", out, set=["steps=4", "frequency=9"], resume=True)


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"set": ["hiden=3"]}, ConfigError),
        ({"preset": "fast"}, ConfigError),
        ({"init": "no-such-model"}, CheckpointError),
        ({"resume": True}, CheckpointError),
    ],
)
def test_bad_input_leaves_nothing_behind(tmp_path, options, error):
    with pytest.raises(error):
        nca.fit("lava", tmp_path / "run", **options)
    assert not (tmp_path / "run").exists()
