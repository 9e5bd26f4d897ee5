"""Model files: round trips, the authors' weights, run folders, and what is refused."""

import json
import os
import struct
from dataclasses import asdict

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from mitex.errors import CheckpointError, OutputError
from mitex.mesh import icosphere
from mitex.methods.nca import METHOD, MeshNCA, NcaConfig, NcaTexture, files
from mitex.methods.nca.decoder.decoder import Decoder, Readout
from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.look import STATE_CHANNELS, Look
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
    assert _same(again.look, original.look)
    rules = (again.look.rule, original.look.rule)
    assert rules[0].degree == rules[1].degree and rules[0].condition == rules[1].condition
    assert again.look.maps == ("albedo", "height")
    assert again.about["name"] == "tiny"


DECODERS = [
    None,
    DecoderShape(),
    DecoderShape(interpolation="linear", coordinates=(), width=5, depth=1, omega=30.0),
    DecoderShape(coordinates=("waves", "barycentrics", "polynomials"), waves=3, frequencies=(1.5,)),
    DecoderShape(coordinates=("polynomials",), amplitude=0.7),
]


@pytest.mark.parametrize("shape", DECODERS)
@pytest.mark.parametrize("mean", [True, False])
def test_a_decoder_survives_saving(tmp_path, shape, mean):
    """Bit by bit, with everything that shapes it; so does what it shows."""
    look = Look(MeshNCA(hidden=8), ("albedo", "height"), shape, mean)
    look.initialise(torch.Generator().manual_seed(1), gain=0.5)
    look.track(torch.rand(9, 16, generator=torch.Generator().manual_seed(2)))  # other bounds
    original = NcaTexture(look, {"name": "tiny"})
    again = NcaTexture.load(original.save(tmp_path / "m.safetensors"))
    assert _same(again.look, look) and again.look.mean == mean
    assert type(again.look.decoder) is type(look.decoder)
    assert again.look.interpolation == look.interpolation
    assert shape is None or again.look.decoder.shape == shape
    shown = [t.apply(icosphere(2), steps=3, subdivide=1, resolution=32) for t in (original, again)]
    for name in look.maps:
        assert np.array_equal(shown[0].maps[name], shown[1].maps[name])


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


def test_what_is_known_about_a_model_is_kept(tmp_path):
    original = texture()
    about = {"name": "ü", "steps": 12, "loss": 0.25, "parent": "waffle", "family": "0123456789ab"}
    files.save(tmp_path / "m.safetensors", original.look, about)
    assert NcaTexture.load(tmp_path / "m.safetensors").about == about | {"maps": ["albedo"]}


def test_a_file_is_small(tmp_path):
    assert texture(shape=DecoderShape()).save(tmp_path / "m.safetensors").stat().st_size < 70_000


@pytest.mark.parametrize("condition", [0, 3])
def test_the_authors_weights(tmp_path, condition):
    """Two linear layers and no description: all five maps, degree 1, sums, and no decoder."""
    model = MeshNCA(condition=condition)
    path = tmp_path / "Wall_Shells_001.safetensors"
    save_file({k: v.contiguous() for k, v in model.state_dict().items()}, path)
    loaded = NcaTexture.load(path)
    look = loaded.look
    assert _same(look.rule, model) and look.rule.condition == condition
    assert look.maps == ("albedo", "ambient_occlusion", "height", "normal", "roughness")
    assert isinstance(look.decoder, Readout) and not look.mean and look.interpolation == "linear"
    assert look.decoder.channels == [0, 1, 2, 11, 6, 7, 8, 9, 10]
    assert loaded.about["name"] == "Wall_Shells_001"


def test_the_authors_weights_grow_as_theirs_do(tmp_path):
    """Sums over the neighbours, and the maps are channels of the state."""
    model = MeshNCA(hidden=8)
    model.initialise(torch.Generator().manual_seed(0), gain=0.5)
    save_file({k: v.contiguous() for k, v in model.state_dict().items()}, tmp_path / "m.safetensors")
    sphere, generator = icosphere(3), torch.Generator().manual_seed(4)
    state = model.seed(sphere)
    with torch.no_grad():
        for _ in range(4):
            mask = torch.rand(1, len(sphere.vertices), generator=generator) < 0.5
            state = model.step(state, sphere, mask)
    maps = NcaTexture.load(tmp_path / "m.safetensors").apply(sphere, seed=4, steps=4, subdivide=0).vertex_maps
    assert 0.01 < state.abs().max() < 1
    for name, channels in STATE_CHANNELS.items():
        expected = np.clip(state[0, :, list(channels)].numpy() + 0.5, 0, 1)
        assert np.allclose(maps[name], expected, atol=1e-6)


def test_half_precision_weights(tmp_path):
    model = MeshNCA(hidden=8)
    path = tmp_path / "m.safetensors"
    save_file({k: v.half() for k, v in model.state_dict().items()}, path)
    loaded = NcaTexture.load(path).look.rule
    assert loaded.fc1.weight.dtype == torch.float32
    assert torch.equal(loaded.fc1.weight, model.fc1.weight.half().float())


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
    assert _same(loaded.look, first)
    assert loaded.look.maps == maps
    assert loaded.about["name"] == "lava" and loaded.about["steps"] == 5 and loaded.about["preset"] == "patch"

    files.save(tmp_path / files.NAME, second, {"name": "lava"})
    _make_older(tmp_path / checkpoint.NAME)
    assert _same(NcaTexture.load(str(tmp_path)).look, second)

    checkpoint.save(tmp_path, _checkpoint(third, 9))
    _make_older(tmp_path / files.NAME)
    assert _same(NcaTexture.load(tmp_path).look, third)


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
    assert _same(NcaTexture.load(tmp_path).look, look)


def test_a_checkpoint_that_is_named_is_the_one_that_is_read(tmp_path):
    for step in (5, 9):
        look = texture(("albedo", "height"), hidden=step).look
        checkpoint.save(tmp_path, _checkpoint(look, step))
    for name, step in ((checkpoint.PREVIOUS, 5), (checkpoint.NAME, 9)):
        loaded = NcaTexture.load(tmp_path / name)
        assert (loaded.about["steps"], loaded.look.rule.hidden) == (step, step)


def test_bundled_models_are_found_by_name():
    models = bundled(METHOD)
    assert models, "no model is bundled"
    for name, path in models.items():
        loaded = NcaTexture.load(name)
        assert loaded.about["name"] == name
        assert loaded.look.rule.channels == 16
        assert path.stat().st_size < 100_000


@pytest.mark.parametrize("name", sorted(bundled(METHOD)))
def test_bundled_models_grow(name):
    """Those that were trained before there was a decoder, too: as their maps are channels of the state."""
    texture = NcaTexture.load(name)
    maps = texture.apply(icosphere(3), steps=5, subdivide=1, resolution=32).maps
    assert set(maps) == set(texture.look.maps)
    state = texture.grow(icosphere(3), steps=30)
    assert 0.01 < state.abs().max() < 1.2
    assert isinstance(texture.look.decoder, Readout) != texture.look.mean


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
