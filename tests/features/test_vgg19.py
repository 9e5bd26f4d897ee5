"""VGG-19 from a file: both layouts, the scale of the input, what is refused."""

import pytest
import torch
import torch.nn.functional as F
from safetensors.torch import save_file

from mitex.features import Vgg16
from mitex.features.layers import LAYERS_19
from mitex.features.normalisation import SPREAD
from mitex.features.vgg import MEAN_RGB
from mitex.features.vgg19 import vgg19_convolutions, vgg19_path
from mitex.features.weights import WeightsError

WIDTHS = (64, 64, 128, 128, *(256,) * 4, *(512,) * 8)
TORCHVISION = (0, 2, 5, 7, 10, 12, 14, 16, 19, 21, 23, 25, 28, 30, 32, 34)


def tensors(names):
    generator = torch.Generator().manual_seed(0)
    weights, inputs = {}, 3
    for name, outputs in zip(names, WIDTHS, strict=True):
        weight = torch.randn(outputs, inputs, 3, 3, generator=generator) * (2 / (9 * inputs)) ** 0.5
        weights[f"{name}.weight"], weights[f"{name}.bias"] = (
            weight,
            0.1 * torch.randn(outputs, generator=generator),
        )
        inputs = outputs
    return weights


def saved(tmp_path, names):
    path = tmp_path / "vgg19.safetensors"
    save_file(tensors(names), path)
    return path


def test_own_layout_is_taken_as_it_is(tmp_path):
    names = [layer.replace("relu", "conv") for layer in LAYERS_19]
    convolutions = vgg19_convolutions(saved(tmp_path, names))
    assert list(convolutions) == list(LAYERS_19) and len(convolutions) == 16
    assert torch.equal(convolutions["relu5_4"][0], tensors(names)["conv5_4.weight"])


def test_torchvisions_layout_gives_its_features(tmp_path):
    """The reference normalises the image as torchvision does, and runs its list of modules."""
    parameters = tensors([f"features.{n}" for n in TORCHVISION])
    network = Vgg16(
        precision="float32",
        pool="max",
        weights=vgg19_convolutions(saved(tmp_path, [f"features.{n}" for n in TORCHVISION])),
    )
    image = torch.rand(1, 48, 48, 3, generator=torch.Generator().manual_seed(1))
    x = (image - torch.tensor(MEAN_RGB) / 255) / torch.tensor(SPREAD)
    x = x.permute(0, 3, 1, 2)
    for name, n in zip(LAYERS_19, TORCHVISION, strict=True):
        if name.endswith("_1") and n:
            x = F.max_pool2d(x, 2)
        x = F.conv2d(
            x, parameters[f"features.{n}.weight"], parameters[f"features.{n}.bias"], padding=1
        ).relu()
    features = network.features(image, ["relu5_4"])["relu5_4"].permute(0, 3, 1, 2)
    assert (features - x).abs().max() < 1e-4 * x.abs().max()


def test_what_is_not_vgg19_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("MITEX_VGG19", str(tmp_path / "none"))
    with pytest.raises(WeightsError, match="VGG-19 weights are not at"):
        vgg19_path()
    broken = tmp_path / "broken.safetensors"
    broken.write_bytes(b"no")
    with pytest.raises(WeightsError, match="not a safetensors file"):
        vgg19_convolutions(broken)
    names = [layer.replace("relu", "conv") for layer in LAYERS_19]
    few = {key: value for key, value in tensors(names).items() if "5_4" not in key}
    save_file(few, broken)
    monkeypatch.setenv("MITEX_VGG19", str(broken))
    with pytest.raises(WeightsError, match="no conv5_4"):
        vgg19_convolutions()
