"""Model files: round trips, the authors' weights, and bundled models."""

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from mitex.errors import OutputError
from mitex.mesh import icosphere
from mitex.methods.nca import METHOD, MeshNCA, NcaTexture, files
from mitex.methods.nca.decoder.decoder import Readout
from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.look import STATE_CHANNELS, Look
from mitex.methods.registry import bundled
from mitex.training import model_file
from tests.methods.nca.tiny import same_weights, texture


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
    assert same_weights(again.look, original.look)
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
    assert same_weights(again.look, look) and again.look.mean == mean
    assert type(again.look.decoder) is type(look.decoder)
    assert again.look.interpolation == look.interpolation
    assert shape is None or again.look.decoder.shape == shape
    shown = [t.apply(icosphere(2), steps=3, subdivide=1, resolution=32) for t in (original, again)]
    for name in look.maps:
        assert np.array_equal(shown[0].maps[name], shown[1].maps[name])


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
    assert same_weights(look.rule, model) and look.rule.condition == condition
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
