"""VGG-19's convolutions from a file of the user's; Mitex ships VGG-16 only."""

from __future__ import annotations

import os
from pathlib import Path

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file

from mitex.features.layers import CHANNELS, LAYERS_19
from mitex.features.normalisation import SPREAD
from mitex.features.vgg import Vgg16, Weights
from mitex.features.weights import WeightsError
from mitex.paths import cache_dir

VARIABLE = "MITEX_VGG19"
FILE = "vgg19.safetensors"


def named_vgg(network: str, pool: str = "average", normalised: bool = True) -> Vgg16:
    """The package's "vgg16", or "vgg19" of the user's file, whose layers cannot be normalised.

    Args:
        network: which one.
        pool, normalised: as of `Vgg16`.

    Raises:
        WeightsError: there is no file, or it is not VGG-19's.
    """
    return Vgg16(pool, normalised=normalised, weights=vgg19_convolutions() if network == "vgg19" else None)


def vgg19_path() -> Path:
    """`MITEX_VGG19` if set, else vgg19.safetensors in the user's cache folder.

    Raises:
        WeightsError: there is no such file.
    """
    path = Path(os.environ.get(VARIABLE) or cache_dir() / "weights" / FILE)
    if not path.is_file():
        raise WeightsError(
            f"the VGG-19 weights are not at {path}",
            f"put a safetensors file there or name one in {VARIABLE}; the package's VGG-16 needs none",
        )
    return path


def vgg19_convolutions(path: Path | None = None) -> Weights:
    """Layer -> weight (O, I, 3, 3) and bias (O,), float32, in order, for RGB in [0, 255] minus the mean.

    Args:
        path: a safetensors file that names its tensors like Mitex's VGG-16 ("conv1_1.weight") or like
            torchvision's network ("features.0.weight"), as converted files of it do; `vgg19_path()` if None.

    Raises:
        WeightsError: there is none, or it is not VGG-19's.
    """
    path = path or vgg19_path()
    try:
        tensors = load_file(path)
    except (SafetensorError, OSError) as e:
        raise WeightsError(f"'{path}' is not a safetensors file ({e})", "convert the weights") from e
    torchvision = "features.0.weight" in tensors
    layers: dict[str, tuple[torch.Tensor, torch.Tensor]] = {}
    inputs = 3
    for name, number in zip(LAYERS_19, _numbers(), strict=True):
        key = f"features.{number}" if torchvision else name.replace("relu", "conv")
        outputs = CHANNELS[f"{name[:5]}_1"]
        weight, bias = tensors.get(f"{key}.weight"), tensors.get(f"{key}.bias")
        if (
            weight is None
            or bias is None
            or weight.shape != (outputs, inputs, 3, 3)
            or bias.shape != (outputs,)
        ):
            raise WeightsError(f"'{path}' has no {key} of VGG-19", "name another file")
        layers[name] = weight.float(), bias.float()
        inputs = outputs
    if torchvision:
        weight, bias = layers["relu1_1"]
        layers["relu1_1"] = weight / (255 * torch.tensor(SPREAD))[:, None, None], bias
    return layers


def _numbers() -> list[int]:
    """Numbers of the convolutions in torchvision's list, which counts ReLUs and poolings too."""
    numbers, number = [], 0
    for name in LAYERS_19:
        if name.endswith("_1") and name != "relu1_1":
            number += 1
        numbers.append(number)
        number += 2
    return numbers
