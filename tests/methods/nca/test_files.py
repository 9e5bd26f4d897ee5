"""Model files: round trips, the authors' weights, run folders, and what is refused."""

import json
import os
import struct

import pytest
import torch
from safetensors.torch import load_file, save_file

from mitex.errors import CheckpointError, OutputError
from mitex.methods.nca import METHOD, MeshNCA, NcaTexture, files
from mitex.methods.registry import bundled
from mitex.training import checkpoint, model_file
from mitex.training.checkpoint import Checkpoint
from tests.methods.nca.tiny import texture


def _same(one, other):
    a, b = one.state_dict(), other.state_dict()
    return a.keys() == b.keys() and all(torch.equal(a[k], b[k]) for k in a)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"degree": 0},
        {"degree": 2, "hidden": 8},
        {"condition": 3},
        {"degree": 0, "condition": 100},  # as wide as a model of degree 1 with a smaller condition
        {"degree": 1, "condition": 80},
        {"channels": 32, "hidden": 20},
    ],
)
def test_round_trip(tmp_path, options):
    original = texture(("albedo", "height"), **options)
    again = NcaTexture.load(original.save(tmp_path / "texture.safetensors"))
    assert _same(again.model, original.model)
    assert (again.model.degree, again.model.condition) == (original.model.degree, original.model.condition)
    assert again.maps == ("albedo", "height")
    assert again.about["name"] == "tiny"


def test_what_is_known_about_a_model_is_kept(tmp_path):
    original = texture()
    about = {"name": "ü", "steps": 12, "loss": 0.25, "parent": "waffle"}
    files.save(tmp_path / "m.safetensors", original.model, about | {"maps": ["albedo"]})
    assert NcaTexture.load(tmp_path / "m.safetensors").about == about | {"maps": ["albedo"]}


def test_a_file_is_small(tmp_path):
    assert texture().save(tmp_path / "m.safetensors").stat().st_size < 55_000


@pytest.mark.parametrize("condition", [0, 3])
def test_the_authors_weights(tmp_path, condition):
    """Two linear layers and no description: all five maps, degree 1."""
    model = MeshNCA(condition=condition)
    path = tmp_path / "Wall_Shells_001.safetensors"
    save_file({k: v.contiguous() for k, v in model.state_dict().items()}, path)
    loaded = NcaTexture.load(path)
    assert _same(loaded.model, model) and loaded.model.condition == condition
    assert loaded.maps == ("albedo", "ambient_occlusion", "height", "normal", "roughness")
    assert loaded.about["name"] == "Wall_Shells_001"


def test_half_precision_weights(tmp_path):
    model = MeshNCA(hidden=8)
    path = tmp_path / "m.safetensors"
    save_file({k: v.half() for k, v in model.state_dict().items()}, path)
    loaded = NcaTexture.load(path).model
    assert loaded.fc1.weight.dtype == torch.float32
    assert torch.equal(loaded.fc1.weight, model.fc1.weight.half().float())


def _checkpoint(model, step, **changes):
    values = {
        "step": step,
        "seconds": 1.0,
        "loss": 1.0,
        "skipped": 0,
        "config": {"preset": "patch", "degree": model.degree},
        "task": {f"model.{k}": v for k, v in model.state_dict().items()} | {"pool.states": torch.zeros(2)},
        "optimizer": {},
        "generator": torch.Generator().get_state(),
        "metadata": {"method": "nca", "maps": "albedo,height", "exemplar": "lava"},
    }
    return Checkpoint(**(values | changes))


def test_a_run_folder_stands_for_its_newest_model(tmp_path):
    """A stopped run has a checkpoint only, a finished one a model, a resumed one a newer checkpoint."""
    first, second, third = (texture(seed=seed).model for seed in range(3))
    checkpoint.save(tmp_path, _checkpoint(first, 5))
    loaded = NcaTexture.load(tmp_path)
    assert _same(loaded.model, first)
    assert loaded.maps == ("albedo", "height")
    assert loaded.about["name"] == "lava" and loaded.about["steps"] == 5 and loaded.about["preset"] == "patch"

    files.save(tmp_path / files.NAME, second, {"name": "lava", "maps": ["albedo"]})
    _make_older(tmp_path / checkpoint.NAME)
    assert _same(NcaTexture.load(str(tmp_path)).model, second)

    checkpoint.save(tmp_path, _checkpoint(third, 9))
    _make_older(tmp_path / files.NAME)
    assert _same(NcaTexture.load(tmp_path).model, third)


def _make_older(path):
    status = path.stat()
    os.utime(path, (status.st_atime - 10, status.st_mtime - 10))


def test_the_previous_checkpoint_will_do(tmp_path):
    model = texture().model
    checkpoint.save(tmp_path, _checkpoint(model, 5))
    (tmp_path / checkpoint.NAME).rename(tmp_path / checkpoint.PREVIOUS)
    assert _same(NcaTexture.load(tmp_path).model, model)


def test_a_checkpoint_that_is_named_is_the_one_that_is_read(tmp_path):
    for step in (5, 9):
        checkpoint.save(tmp_path, _checkpoint(MeshNCA(hidden=step), step))
    for name, step in ((checkpoint.PREVIOUS, 5), (checkpoint.NAME, 9)):
        loaded = NcaTexture.load(tmp_path / name)
        assert (loaded.about["steps"], loaded.model.hidden) == (step, step)


def test_bundled_models_are_found_by_name():
    models = bundled(METHOD)
    assert models, "no model is bundled"
    for name, path in models.items():
        loaded = NcaTexture.load(name)
        assert loaded.about["name"] == name
        assert loaded.model.channels == 16
        assert path.stat().st_size < 100_000


def _tensors(**changes):
    tensors = {k: v.clone() for k, v in MeshNCA(hidden=8).state_dict().items()}
    return {k: v for k, v in (tensors | changes).items() if v is not None}


@pytest.mark.parametrize(
    "changes",
    [
        {"fc1.bias": None},
        {"fc3.weight": torch.zeros(2, 2)},
        {"fc1.weight": torch.zeros(80)},
        {"fc1.bias": torch.zeros(7)},
        {"fc2.weight": torch.zeros(16, 9)},
        {"fc1.weight": torch.zeros(8, 31)},  # not even the state and its Laplacian
        {"fc2.weight": torch.zeros(0, 8), "fc2.bias": torch.zeros(0)},
    ],
)
def test_wrong_tensors(tmp_path, changes):
    save_file(_tensors(**changes), tmp_path / "m.safetensors")
    with pytest.raises(CheckpointError, match="does not hold a MeshNCA"):
        NcaTexture.load(tmp_path / "m.safetensors")


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_weights_that_are_not_finite(tmp_path, value):
    weight = torch.zeros(8, 80)
    weight[3, 4] = value
    save_file(_tensors(**{"fc1.weight": weight}), tmp_path / "m.safetensors")
    with pytest.raises(CheckpointError, match="not finite"):
        NcaTexture.load(tmp_path / "m.safetensors")


@pytest.mark.parametrize(
    ("about", "problem"),
    [
        ({"maps": ["albedo", "glitter"]}, "glitter"),
        ({"maps": []}, "unknown maps"),
        ({"maps": 3}, "damaged"),
        ([1], "damaged"),
        ("{", "damaged"),
    ],
)
def test_damaged_descriptions(tmp_path, about, problem):
    text = about if isinstance(about, str) else json.dumps(about)
    save_file(_tensors(), tmp_path / "m.safetensors", {"about": text})
    with pytest.raises(CheckpointError, match=problem):
        NcaTexture.load(tmp_path / "m.safetensors")


def test_a_degree_that_the_weights_are_too_small_for(tmp_path):
    save_file(_tensors(), tmp_path / "m.safetensors", {"degree": "2"})
    with pytest.raises(CheckpointError, match="does not hold"):
        NcaTexture.load(tmp_path / "m.safetensors")


def test_maps_that_the_state_has_no_room_for(tmp_path):
    model = MeshNCA(channels=4, hidden=8)
    files.save(tmp_path / "m.safetensors", model, {"maps": ["albedo"]})
    assert NcaTexture.load(tmp_path / "m.safetensors").maps == ("albedo",)
    files.save(tmp_path / "m.safetensors", model, {"maps": ["albedo", "height"]})
    with pytest.raises(CheckpointError, match="4 channels, its maps need 7"):
        NcaTexture.load(tmp_path / "m.safetensors")


@pytest.mark.parametrize("damage", ["truncated", "garbage", "empty", "header"])
def test_damaged_files(tmp_path, damage):
    path = texture().save(tmp_path / "m.safetensors")
    content = path.read_bytes()
    changed = {
        "truncated": content[: len(content) // 2],
        "garbage": os.urandom(2000),
        "empty": b"",
        "header": struct.pack("<Q", 2**60) + content[8:],
    }
    path.write_bytes(changed[damage])
    with pytest.raises(CheckpointError):
        NcaTexture.load(path)


def test_a_checkpoint_of_another_method(tmp_path):
    model = texture().model
    checkpoint.save(tmp_path, _checkpoint(model, 5, task={"weights": torch.zeros(3)}))
    with pytest.raises(CheckpointError, match="does not hold a MeshNCA"):
        NcaTexture.load(tmp_path)


@pytest.mark.parametrize("source", ["wafle", "no/such/file", "a\0b", "x" * 5000])
def test_nothing_there(source):
    with pytest.raises(CheckpointError):
        NcaTexture.load(source)


def test_a_near_name_is_suggested():
    with pytest.raises(CheckpointError, match="did you mean waffle"):
        NcaTexture.load("wafle")


def test_a_folder_without_a_model(tmp_path):
    with pytest.raises(CheckpointError, match="no model in"):
        NcaTexture.load(tmp_path)


def test_saving_is_atomic(tmp_path, monkeypatch):
    """A full disk leaves the older file as it was."""
    path = texture(seed=1).save(tmp_path / "m.safetensors")
    before = load_file(path)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(model_file, "save_file", full)
    with pytest.raises(OutputError, match="no space left"):
        texture(seed=2).save(path)
    assert all(torch.equal(v, before[k]) for k, v in load_file(path).items())
    assert [p.name for p in tmp_path.iterdir()] == ["m.safetensors"]
