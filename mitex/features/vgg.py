"""VGG-16 features of images, frozen (Simonyan & Zisserman 2015)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import cache

import torch

from mitex.errors import ConfigError
from mitex.features import weights
from mitex.features.frozen import FrozenConv, FrozenStack, GramTap, Operation, Pool, Tap
from mitex.features.layers import LAYERS, WIDTHS, halvings
from mitex.runtime import uses_bfloat16

Weights = Mapping[str, tuple[torch.Tensor, torch.Tensor]]  # layer -> weight (O, I, 3, 3), bias (O,)
MEAN_RGB = (123.68, 116.779, 103.939)  # of ImageNet, in [0, 255]


class Vgg16:
    """The 13 convolution layers of VGG-16 with the package's weights.

    Args:
        pool: "average" (as in the style literature and the authors' MeshNCA) or "max" (as trained).
        precision: "bfloat16", "float32", or "auto": bfloat16 where the CPU multiplies it natively. Its maps
            are 0.5 % off; gradients of the MeshNCA loss have a cosine of 0.999 with those of float32 ("max"
            0.998, Gram matrices 0.9985): rounding shuts or opens a few ReLUs, all else is negligible.
        normalised: divide every layer by its mean activation on textures, so that losses that are not scale
            free (moments, Gram) weigh the layers alike. Without it the published weights' means lie between
            0.1 and 120.
        device: where the weights live.
        weights: layer -> weight, bias, which `normalised` does not change; None takes the package's.
    """

    def __init__(
        self,
        pool: str = "average",
        precision: str = "auto",
        normalised: bool = True,
        device: str = "cpu",
        weights: Weights | None = None,
    ) -> None:
        if pool not in ("average", "max"):
            raise ConfigError(f"unknown pooling {pool!r}", "use 'average' or 'max'")
        self.pool, self.normalised, self.device = pool, normalised, device
        self.dtype = torch.bfloat16 if uses_bfloat16(precision, device) else torch.float32
        self.operations: list[Operation] = []
        self._names: list[str] = []  # of what the operations give
        self._mean = torch.tensor(MEAN_RGB, device=device)
        if weights:
            layers = _frozen(weights, device, self.dtype)
        else:
            layers = _shipped(pool, normalised, device, self.dtype)
        for name, layer in layers.items():
            if name.endswith("_1") and name != "relu1_1":
                self._append(f"pool{halvings(name)}", Pool(pool))
            self._append(name, layer)
        self._append(f"pool{len(WIDTHS)}", Pool(pool))

    def features(self, images: torch.Tensor, layers: Iterable[str]) -> dict[str, torch.Tensor]:
        """Whole feature maps.

        Args:
            images: (K, H, W, 3) sRGB in [0, 1] (values outside are passed on).
            layers: names out of `LAYERS`, or of poolings ("pool1" to "pool5").

        Returns:
            name -> (K, h, w, C) float32, differentiable in `images` (once).

        Raises:
            ConfigError: no or an unknown layer, images of another shape or too small for a layer.
        """
        maps = self.read(images, {name: Tap(self.index_of(name)) for name in layers})
        return {name: m.permute(0, 2, 3, 1) for name, m in maps.items()}

    def samples(self, images: torch.Tensor, positions: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
        """Features at chosen places only: what sampled losses need, without gradients on whole maps.

        Args:
            images: as in `features`.
            positions: layer name -> (K, n) indices into that layer's flattened h * w.

        Returns:
            name -> (K, n, C) float32.

        Raises:
            ConfigError: as in `features`, or positions of another shape or outside a map.
        """
        for name, where in positions.items():
            self._check_positions(images, name, where)
        return self.read(images, {name: Tap(self.index_of(name), p) for name, p in positions.items()})

    def grams(self, images: torch.Tensor, layers: Iterable[str]) -> dict[str, torch.Tensor]:
        """Gram matrices of each image's features, divided by their number.

        Args:
            images, layers: as in `features`.

        Returns:
            name -> (K, C, C) float32, differentiable in `images` (once).
        """
        taps = {}
        for name in layers:
            places = math.prod(self.extent(name, images.shape[1], images.shape[2]))
            each = torch.arange(len(images) * places, device=images.device).split(places)
            taps[name] = GramTap(self.index_of(name), each if len(images) > 1 else None)
        return self.read(images, taps)

    def read(self, images: torch.Tensor, taps: Mapping[str, Tap | GramTap]) -> dict[str, torch.Tensor]:
        """What taps give of images, under their names, in one pass.

        Args:
            images: as in `features`.
            taps: of operations by `index_of`.

        Returns:
            name -> float32 values, differentiable in `images` (once): (K, C, h, w) of a whole tap, (K, n, C)
            of a sampled one, (regions, C, C) of a Gram tap.

        Raises:
            ConfigError: no taps, images of another shape or too small for a layer.
        """
        if not taps:
            raise ConfigError("no VGG-16 layer is asked for", f"name some of {', '.join(LAYERS)}")
        if images.ndim != 4 or images.shape[3] != 3 or not len(images):
            raise ConfigError(f"images of shape {tuple(images.shape)}", "give (K, H, W, 3), K at least 1")
        outputs = list(taps.values())
        deepest = max(tap.index for tap in outputs)
        name = self._names[deepest]
        if min(self.extent(name, images.shape[1], images.shape[2])) < 1:
            raise ConfigError(
                f"images of {tuple(images.shape[1:3])} are too small for {name}", "render larger"
            )
        centred = images.permute(0, 3, 1, 2) * 255 - self._mean[:, None, None]
        centred = centred.contiguous(memory_format=torch.channels_last)
        values = FrozenStack.apply(centred, self.operations[: deepest + 1], outputs)
        return dict(zip(taps, values, strict=True))

    def index_of(self, layer: str) -> int:
        """The operation that gives a layer or a pooling.

        Raises:
            ConfigError: there is no such layer.
        """
        if layer not in self._names:
            raise ConfigError(f"VGG-16 has no layer {layer!r}", f"use one of {', '.join(LAYERS)}")
        return self._names.index(layer)

    def extent(self, layer: str, height: int, width: int) -> tuple[int, int]:
        """(h, w) of a layer's map for an image of (height, width)."""
        return height >> halvings(layer), width >> halvings(layer)

    def _append(self, name: str, operation: Operation) -> None:
        self._names.append(name)
        self.operations.append(operation)

    def _check_positions(self, images: torch.Tensor, name: str, where: torch.Tensor) -> None:
        if where.ndim != 2 or len(where) != len(images):
            raise ConfigError(
                f"positions of shape {tuple(where.shape)} in {name}", f"give ({len(images)}, n) indices"
            )
        places = math.prod(self.extent(name, images.shape[1], images.shape[2]))
        if where.numel() and (where.min() < 0 or where.max() >= places):
            raise ConfigError(f"positions outside the map of {name}", f"give indices below {places}")


def _frozen(weights: Weights, device: str, dtype: torch.dtype) -> dict[str, FrozenConv]:
    """Layers that compute in `dtype`. The first one reads 3 channels: float32 costs nothing there and keeps
    the image exact."""
    return {
        name: FrozenConv(
            weight.to(device), bias.to(device), torch.float32 if name == "relu1_1" else dtype, dtype
        )
        for name, (weight, bias) in weights.items()
    }


@cache
def _shipped(pool: str, normalised: bool, device: str, dtype: torch.dtype) -> Mapping[str, FrozenConv]:
    """Layers with the package's weights, which all networks of a kind share: they take up to 118 MB."""
    return _frozen(convolutions(pool, normalised), device, dtype)


def convolutions(pool: str, normalised: bool) -> Weights:
    """Layer -> weight (O, I, 3, 3) and bias (O,), float32, in order.

    Args:
        pool: "average" or "max", which the scales depend on.
        normalised: divide every layer by its mean activation on textures.
    """
    tensors, before, layers = _load(), 1.0, {}
    for name in LAYERS:
        key, after = name.replace("relu", "conv"), MEAN_ACTIVATION[pool][name] if normalised else 1.0
        layers[name] = tensors[f"{key}.weight"] * (before / after), tensors[f"{key}.bias"] / after
        before = after
    return layers


@cache
def _load() -> dict[str, torch.Tensor]:
    from safetensors.torch import load_file

    path = weights.vgg16_path()
    weights.verify(path, weights.VGG16_SHA256)
    return {name: tensor.float() for name, tensor in load_file(path).items()}


# Mean activation of each layer over the albedo maps of the 12 exemplars of the MeshNCA demo at 128 x 128.
MEAN_ACTIVATION = {
    "average": dict(
        zip(
            LAYERS,
            (25.11, 130.4, 159.6, 200.7, 164.9, 163.2, 111.3, 52.39, 24.08, 4.589, 2.742, 0.8879, 0.1414),
            strict=True,
        )
    ),
    "max": dict(
        zip(
            LAYERS,
            (25.11, 130.4, 205, 246.3, 315.8, 331.9, 223, 187.4, 96.19, 17.9, 18.83, 6.638, 0.752),
            strict=True,
        )
    ),
}
