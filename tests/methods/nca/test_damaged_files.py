"""Model files that are damaged, or missing: what is refused."""

import json
import os
import struct

import pytest
import torch
from safetensors.torch import save_file

from mitex.errors import CheckpointError
from mitex.methods.nca import MeshNCA, NcaTexture, files
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.training import model_file
from tests.methods.nca.tiny import texture

DAMAGE = {
    "no JSON": lambda shape: "{",
    "no table": lambda shape: "3",
    "an unknown part": lambda shape: json.dumps(shape | {"glitter": 1}),
    "unknown coordinates": lambda shape: json.dumps(shape | {"coordinates": ["waves", "spirals"]}),
    "unknown interpolation": lambda shape: json.dumps(shape | {"interpolation": "cubic"}),
    "another width": lambda shape: json.dumps(shape | {"width": 9}),
    "half a layer": lambda shape: json.dumps(shape | {"depth": 1.5}),
    "a word for a width": lambda shape: json.dumps(shape | {"width": "wide"}),
    "far too wide": lambda shape: json.dumps(shape | {"width": 10**12}),
    "no frequencies": lambda shape: json.dumps(shape | {"frequencies": []}),
    "a word for a frequency": lambda shape: json.dumps(shape | {"frequencies": ["high"]}),
    "another depth": lambda shape: json.dumps(shape | {"depth": 3}),
    "other coordinates": lambda shape: json.dumps(shape | {"coordinates": ["polynomials"]}),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_decoder(tmp_path, damage):
    path = texture().save(tmp_path / "m.safetensors")
    tensors, metadata = model_file.read(path)
    text = DAMAGE[damage](json.loads(metadata["decoder"]))
    save_file(tensors, path, metadata | {"decoder": text})
    with pytest.raises(CheckpointError):
        NcaTexture.load(path)


@pytest.mark.parametrize("part", ["description", "tensors", "one tensor"])
def test_a_decoder_of_which_something_is_missing(tmp_path, part):
    path = texture().save(tmp_path / "m.safetensors")
    tensors, metadata = model_file.read(path)
    if part == "description":
        del metadata["decoder"]
    lost = {"description": (), "tensors": ("decoder.",), "one tensor": ("decoder.network.layers.0.bias",)}
    tensors = {name: value for name, value in tensors.items() if not name.startswith(lost[part])}
    save_file(tensors, path, metadata)
    with pytest.raises(CheckpointError, match="does not hold a MeshNCA"):
        NcaTexture.load(path)


def test_a_decoder_with_weights_that_are_not_finite(tmp_path):
    original = texture()
    assert isinstance(original.look.decoder, Decoder)
    with torch.no_grad():
        original.look.decoder.network.linear[1].weight[0, 0] = torch.nan
    with pytest.raises(CheckpointError, match="not finite"):
        NcaTexture.load(original.save(tmp_path / "m.safetensors"))


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
        ({"palette": 3}, "damaged"),
        ({"density": "wide"}, "damaged"),
        ({"density": 1e9}, "density"),
        ({"motion": 7}, "damaged"),
        ({"motion": ["right"], "motion_advection": True}, "damaged"),
        ({"motion": "right", "motion_advection": "no"}, "damaged"),
        ({"motion": "right", "motion_period": "long"}, "damaged"),
        ({"palette": {"colours": [[0, 0, 0]]}}, "damaged"),
        ({"palette": {"colours": [[0, 0]], "radius": 1}}, "damaged"),
        ({"palette": {"colours": [], "radius": 1}}, "damaged"),
        ({"palette": {"colours": [[0, 0, float("nan")]], "radius": 1}}, "damaged"),
        ({"palette": {"colours": [[0, 0, 0]], "radius": 1}, "maps": ["height"]}, "damaged"),
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
    """Without a decoder; with one, four channels may be any maps."""
    path = tmp_path / "m.safetensors"
    assert NcaTexture.load(texture(shape=None, channels=4).save(path)).look.maps == ("albedo",)
    decoded = texture(("albedo", "height"), channels=4)
    assert NcaTexture.load(decoded.save(path)).look.maps == ("albedo", "height")
    files.save(path, texture(("albedo", "height"), shape=None, channels=4).look, {"name": "small"})
    with pytest.raises(CheckpointError, match="4 channels, its maps need 7"):
        NcaTexture.load(path)


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
