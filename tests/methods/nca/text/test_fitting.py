"""The whole way from words to a model file, with a CLIP model of random weights."""

import json

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError, OutputError, WeightsError
from mitex.mesh import icosphere
from mitex.methods import nca
from mitex.methods.nca import NcaTexture
from mitex.runtime import threads
from tests.features.clip.folders import write_folder
from tests.methods.nca.text.tiny_text import SETTINGS, config
from tests.methods.nca.tiny import texture
from tests.training.contract import assert_same_checkpoint

TEXT = "red dots"


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return write_folder(tmp_path_factory.mktemp("models") / "clip")


@pytest.fixture(autouse=True)
def no_other_models(monkeypatch, tmp_path):
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    monkeypatch.delenv("MITEX_CLIP", raising=False)
    threads(1)


@pytest.fixture(scope="module")
def run(tmp_path_factory, clip):
    out = tmp_path_factory.mktemp("fit") / "run"
    settings = [*SETTINGS, "steps=4", "preview_every=4", "checkpoint_every=2", "text_growth_steps=7"]
    threads(1)
    return out, nca.fit_text(TEXT, out, clip=clip, set=settings)


def _weights(one):
    return torch.cat([value.flatten() for value in one.look.state_dict().values()])


def test_the_run_folder_is_complete(run):
    out, _ = run
    names = {path.name for path in out.iterdir()}
    assert {"config.toml", "checkpoint.safetensors", "metrics.jsonl", "texture.safetensors"} <= names
    assert [path.name for path in (out / "previews").iterdir()] == ["000004.png"]
    last = json.loads((out / "metrics.jsonl").read_text().splitlines()[-1])
    assert {"whole", "close", "relief", "rough", "range", "overflow"} <= last.keys()


def test_the_model_works_on_another_mesh(run):
    out, result = run
    about = result.about
    assert (about["name"], about["text"], about["text_model"]) == (TEXT, TEXT, "clip")
    assert about["growth_steps"] == 7
    assert about["preset"] == "text" and about["relief"] == 2.5 and result.look.maps == ("albedo", "height")
    sphere = icosphere(6)
    grown = result.apply(sphere, steps=4, subdivide=0, resolution=None)
    assert set(grown.vertex_maps) == {"albedo", "height", "normal"}
    for source in (out, out / "texture.safetensors"):
        again = NcaTexture.load(source).apply(sphere, steps=4, subdivide=0, resolution=None)
        for name, values in grown.vertex_maps.items():
            assert np.array_equal(values, again.vertex_maps[name])
    (out / "texture.safetensors").rename(out / "other")
    assert NcaTexture.load(out).about["name"] == TEXT  # of its checkpoint
    (out / "other").rename(out / "texture.safetensors")


def test_a_run_that_is_resumed_is_the_run_that_was_not_interrupted(run, clip, tmp_path):
    out, _ = run
    settings = [*SETTINGS, "preview_every=4", "checkpoint_every=2", "text_growth_steps=7"]
    nca.fit_text(TEXT, tmp_path / "parts", clip=clip, set=[*settings, "steps=2"])
    nca.fit_text(TEXT, tmp_path / "parts", steps=4, resume=True)
    assert_same_checkpoint(out, tmp_path / "parts")


def test_what_a_run_cannot_be_resumed_with(run, clip, tmp_path):
    out, _ = run
    other = write_folder(tmp_path / "other", "wide")
    with pytest.raises(CheckpointError, match="text_model"):
        nca.fit_text(TEXT, out, clip=other, steps=6, resume=True)
    with pytest.raises(CheckpointError, match="text"):
        nca.fit_text("red", out, steps=6, resume=True)
    with pytest.raises(CheckpointError, match="mesh"):
        out = tmp_path / "on-a-mesh"
        settings = [*SETTINGS, "steps=0"]
        nca.fit_text(TEXT, out, mesh=icosphere(3), clip=clip, set=[*settings, "text_object=stone"])
        nca.fit_text(TEXT, out, mesh=icosphere(4), steps=1, resume=True)
    with pytest.raises(OutputError, match="holds a run already"):
        nca.fit_text(TEXT, run[0], clip=clip, set=SETTINGS)


def test_a_training_starts_from_a_parent(clip, tmp_path):
    """From its albedo and height, whatever further maps it has; that of the settings or another one."""
    shape, paths = config().decoder_shape, []
    for seed in (1, 2):
        parent = texture(("albedo", "height", "roughness"), seed=seed, hidden=16, shape=shape)
        paths.append(parent.save(tmp_path / f"{seed}.safetensors"))
    settings = [*(s for s in SETTINGS if "parent" not in s), "steps=0", f"text_parent={paths[0]}"]
    first = nca.fit_text(TEXT, clip=clip, set=settings)
    second = nca.fit_text(TEXT, clip=clip, init=paths[1], set=settings)
    new = nca.fit_text(TEXT, clip=clip, set=[*SETTINGS, "steps=0"])
    for child, path in ((first, paths[0]), (second, paths[1])):
        parent = NcaTexture.load(path)
        assert child.about["parent"] == "tiny" and child.family == parent.family
        assert torch.equal(child.look.rule.fc1.weight, parent.look.rule.fc1.weight)
    assert "parent" not in new.about and not torch.equal(_weights(first), _weights(new))


def test_the_shipped_parent_fits_the_preset(clip):
    """With the settings of the presets, but for their size."""
    small = ["steps=0", "frequency=4", "text_bank=1", "surfaces=even", "pool=1"]
    child = nca.fit_text(TEXT, clip=clip, set=small)
    assert child.about["parent"] == "knit" and child.look.rule.hidden == 128
    paper = nca.fit_text(TEXT, clip=clip, preset="text-paper", set=small)
    assert "parent" not in paper.about and sum(p.numel() for p in paper.look.parameters()) == 12_432


@pytest.mark.parametrize(
    ("text", "options", "error", "problem"),
    [
        ("", {}, ConfigError, "the text is empty"),
        ("red " * 10_000, {}, ConfigError, "tokens"),
        (TEXT, {"preset": "patch"}, ConfigError, "preset patch"),
        (TEXT, {"motion": "sideways"}, ConfigError, "sideways"),
        (TEXT, {"motion": "right", "set": ["motion=up"]}, ConfigError, "motion is set to up and to right"),
        (TEXT, {"init": "no-such-model"}, CheckpointError, "no-such-model"),
        (TEXT, {"init": "knit", "set": ["channels=20"]}, CheckpointError, "channels"),
        (TEXT, {"clip": "nowhere"}, WeightsError, "missing is the folder itself"),
        (TEXT, {"resume": True}, CheckpointError, "resume"),
    ],
)
def test_bad_input_leaves_nothing_behind(clip, tmp_path, text, options, error, problem):
    with pytest.raises(error, match=problem):
        nca.fit_text(text, tmp_path / "run", **{"clip": clip, **options})
    assert not (tmp_path / "run").exists()


def test_settings_for_words_are_refused_for_an_exemplar():
    problem = "the settings are for words, not for an exemplar"
    with pytest.raises(ConfigError, match=problem):
        nca.fit("lava", preset="text")
    with pytest.raises(ConfigError, match=problem):
        nca.fit("lava", set=["text=red"])
