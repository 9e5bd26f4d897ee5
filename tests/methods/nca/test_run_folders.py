"""Run folders as models: which of their files is read."""

import os
from dataclasses import asdict

import pytest
import torch

from mitex.errors import CheckpointError
from mitex.methods.nca import NcaConfig, NcaTexture, files
from mitex.training import checkpoint
from mitex.training.checkpoint import Checkpoint
from tests.methods.nca.tiny import same_weights, texture


def _checkpoint(look, step, **changes):
    config = NcaConfig(hidden=look.rule.hidden, waves=8, decoder_width=12, decoder_depth=2)
    values = {
        "step": step,
        "seconds": 1.0,
        "loss": 1.0,
        "skipped": 0,
        "config": asdict(config),
        "task": {f"model.{k}": v for k, v in look.state_dict().items()} | {"pool.states": torch.zeros(2)},
        "optimizer": {},
        "generator": torch.Generator().get_state(),
        "metadata": {"method": "nca", "maps": "albedo,height", "exemplar": "lava"},
    }
    return Checkpoint(**(values | changes))


def test_a_run_folder_stands_for_its_newest_model(tmp_path):
    """A stopped run has a checkpoint only, a finished one a model, a resumed one a newer checkpoint."""
    maps = ("albedo", "height")
    first, second, third = (texture(maps, seed=seed).look for seed in range(3))
    checkpoint.save(tmp_path, _checkpoint(first, 5))
    loaded = NcaTexture.load(tmp_path)
    assert same_weights(loaded.look, first)
    assert loaded.look.maps == maps
    assert loaded.about["name"] == "lava" and loaded.about["steps"] == 5 and loaded.about["preset"] == "patch"

    files.save(tmp_path / files.NAME, second, {"name": "lava"})
    _make_older(tmp_path / checkpoint.NAME)
    assert same_weights(NcaTexture.load(str(tmp_path)).look, second)

    checkpoint.save(tmp_path, _checkpoint(third, 9))
    _make_older(tmp_path / files.NAME)
    assert same_weights(NcaTexture.load(tmp_path).look, third)


@pytest.mark.parametrize(
    "changes",
    [
        {"task": {"weights": torch.zeros(3)}},
        {"config": {"preset": "patch"}},  # another width of the decoder
        {"config": {"resolution": 4096, "layers": ["density"]}},  # another method's
        {"config": {"channels": "many"}},
        {"metadata": {"maps": "albedo,glitter"}},
        {"metadata": {"maps": ""}},
    ],
)
def test_a_checkpoint_that_does_not_fit(tmp_path, changes):
    checkpoint.save(tmp_path, _checkpoint(texture(("albedo", "height")).look, 5, **changes))
    with pytest.raises(CheckpointError):
        NcaTexture.load(tmp_path)


def _make_older(path):
    status = path.stat()
    os.utime(path, (status.st_atime - 10, status.st_mtime - 10))


def test_the_previous_checkpoint_will_do(tmp_path):
    look = texture(("albedo", "height")).look
    checkpoint.save(tmp_path, _checkpoint(look, 5))
    (tmp_path / checkpoint.NAME).rename(tmp_path / checkpoint.PREVIOUS)
    assert same_weights(NcaTexture.load(tmp_path).look, look)


def test_a_checkpoint_that_is_named_is_the_one_that_is_read(tmp_path):
    for step in (5, 9):
        look = texture(("albedo", "height"), hidden=step).look
        checkpoint.save(tmp_path, _checkpoint(look, step))
    for name, step in ((checkpoint.PREVIOUS, 5), (checkpoint.NAME, 9)):
        loaded = NcaTexture.load(tmp_path / name)
        assert (loaded.about["steps"], loaded.look.rule.hidden) == (step, step)
