"""Where weights are looked for, and what is refused."""

import pytest
import torch
from safetensors.torch import load_file, save_file

from mitex.features import vgg, weights
from mitex.features.weights import VGG16_SHA256, WeightsError, verify, vgg16_path


@pytest.fixture
def fresh():
    """Nothing loaded, before and after."""
    for loaded in (vgg._load, vgg._shipped):
        loaded.cache_clear()
    yield
    for loaded in (vgg._load, vgg._shipped):
        loaded.cache_clear()


def test_the_package_ships_the_published_file(monkeypatch):
    monkeypatch.delenv("MITEX_VGG16", raising=False)
    path = vgg16_path()
    verify(path, VGG16_SHA256)
    tensors = load_file(path)
    assert len(tensors) == 26
    assert tensors["conv1_1.weight"].shape == (64, 3, 3, 3)
    assert tensors["conv5_3.weight"].shape == (512, 512, 3, 3)
    assert tensors["conv5_3.bias"].shape == (512,)


def test_the_mean_colour_is_zero_to_the_network(monkeypatch):
    """So that only the biases answer."""
    monkeypatch.delenv("MITEX_VGG16", raising=False)
    mean = torch.tensor(vgg.MEAN_RGB) / 255
    biases = load_file(vgg16_path())["conv1_1.bias"].float()
    network = vgg.Vgg16(precision="float32", normalised=False)
    answer = network.features(mean.expand(1, 16, 16, 3), ["relu1_1"])["relu1_1"]
    assert torch.allclose(answer[0, 8, 8], biases.relu(), atol=1e-4)


def test_another_place(monkeypatch, tmp_path):
    place = tmp_path / "vgg.safetensors"
    place.write_bytes(b"")
    monkeypatch.setenv("MITEX_VGG16", str(place))
    assert vgg16_path() == place


@pytest.mark.parametrize("kind", ["missing", "folder"])
def test_no_file(monkeypatch, tmp_path, fresh, kind):
    place = tmp_path / "vgg.safetensors" if kind == "missing" else tmp_path
    monkeypatch.setenv("MITEX_VGG16", str(place))
    with pytest.raises(WeightsError, match="are not at"):
        vgg.Vgg16()


def test_one_wrong_bit(monkeypatch, tmp_path, fresh):
    content = bytearray(vgg16_path().read_bytes())
    content[len(content) // 2] ^= 1
    place = tmp_path / "vgg.safetensors"
    place.write_bytes(content)
    monkeypatch.setenv("MITEX_VGG16", str(place))
    with pytest.raises(WeightsError, match="not the expected file"):
        vgg.Vgg16()


def test_other_weights(monkeypatch, tmp_path, fresh):
    place = tmp_path / "vgg.safetensors"
    save_file({"conv1_1.weight": torch.zeros(64, 3, 3, 3)}, place)
    monkeypatch.setenv("MITEX_VGG16", str(place))
    with pytest.raises(WeightsError, match="not the expected file"):
        vgg.Vgg16()


def test_unreadable_file(monkeypatch, tmp_path):
    place = tmp_path / "vgg.safetensors"
    place.write_bytes(b"x")

    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(weights.Path, "open", refuse)
    with pytest.raises(WeightsError, match="Permission denied"):
        verify(place, "0" * 64)
