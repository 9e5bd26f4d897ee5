"""The network of solid textures: from noise at six scales to colours (Gutierrez et al. 2020, section 3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import torch
import torch.nn.functional as F

from mitex.features.normalisation import MEAN
from mitex.methods.baselines.solid_texture.boxes import Box, needed
from mitex.methods.baselines.solid_texture.convolution import convolve

SCALES = 6
NOISE = 3  # channels of the noise at each scale
CHANNELS = 4  # that each scale adds
KERNELS = (3, 3, 1)  # of a block's convolutions, unpadded
SLOPE = 0.01  # of the leaky rectifiers
MOMENTUM = 0.1  # of the running statistics of batch normalisation


@dataclass(frozen=True, eq=False)
class Generator:
    """The network. At a scale, a block works on the noise, another one on that and what comes from below.

    Attributes:
        tensors: weights by name, as of `shapes`.
        statistics: running means and variances of the channels, as of `statistic_shapes`.
    """

    tensors: Mapping[str, torch.Tensor]
    statistics: Mapping[str, torch.Tensor]

    @staticmethod
    def random(generator: torch.Generator) -> Generator:
        """Weights as PyTorch's layers begin with."""
        tensors = {}
        for name, shape in shapes().items():
            kind = name.rsplit("/")[-1]
            if kind in ("gain", "shift"):
                tensors[name] = torch.full(shape, float(kind == "gain"))
            else:
                fan_in = torch.Size(shapes()[name.replace("bias", "weight")][1:]).numel()
                tensors[name] = torch.empty(shape).uniform_(-1, 1, generator=generator) / fan_in**0.5
        statistics = {
            name: torch.full(s, float("variance" in name)) for name, s in statistic_shapes().items()
        }
        return Generator(tensors, statistics)

    def colours(
        self, box: Box, noise: Sequence[torch.Tensor], updated: Mapping[str, torch.Tensor] | None = None
    ) -> torch.Tensor:
        """(K, 3, X, Y, Z) sRGB of a box, unbounded.

        Args:
            box: voxels at the finest scale.
            noise: (K, 3, ...) for each of `noise_boxes(box)`, uniform in [0, 1].
            updated: statistics that move towards those of this batch, by which it is normalised then (a
                training step); None: the running ones.
        """
        boxes = needed(box, SCALES)
        features = self._block(f"noise{SCALES - 1}", noise[-1], updated)
        for scale in range(SCALES - 2, -1, -1):
            features = self._normalised(f"up{scale}", features, updated)
            for axis in (2, 3, 4):
                features = features.repeat_interleave(2, axis)
            features = features[:, :, *boxes[scale].grown().within(boxes[scale + 1])]
            own = self._block(f"noise{scale}", noise[scale], updated)
            features = self._block(f"join{scale}", torch.cat([features, own], 1), updated)
        # In steps of an 8-bit level, as published, so that the published learning rate fits.
        levels = convolve(features, self.tensors["colour/weight"], self.tensors["colour/bias"])
        return levels / 255 + levels.new_tensor(MEAN).view(1, 3, 1, 1, 1)

    def _block(
        self, name: str, values: torch.Tensor, updated: Mapping[str, torch.Tensor] | None
    ) -> torch.Tensor:
        for k in range(len(KERNELS)):
            layer = f"{name}/{k}"
            values = convolve(values, self.tensors[f"{layer}/weight"], self.tensors[f"{layer}/bias"])
            values = F.leaky_relu(self._normalised(layer, values, updated), SLOPE)
        return values

    def _normalised(
        self, name: str, values: torch.Tensor, updated: Mapping[str, torch.Tensor] | None
    ) -> torch.Tensor:
        statistics = self.statistics if updated is None else updated
        return F.batch_norm(
            values,
            statistics[f"{name}/mean"],
            statistics[f"{name}/variance"],
            self.tensors[f"{name}/gain"],
            self.tensors[f"{name}/shift"],
            training=updated is not None,
            momentum=MOMENTUM,
        )


def noise_boxes(box: Box) -> list[Box]:
    """The voxels of noise that colours of a box depend on, from the finest scale on."""
    boxes = needed(box, SCALES)
    return [one.grown().grown() for one in boxes[:-1]] + [boxes[-1].grown()]


def shapes() -> dict[str, tuple[int, ...]]:
    """Shapes of the weights by name; 84,963 numbers together."""
    result: dict[str, tuple[int, ...]] = {}
    for name, width, inputs in _blocks():
        for k, kernel in enumerate(KERNELS):
            result[f"{name}/{k}/weight"] = (width, inputs if k == 0 else width, *[kernel] * 3)
            result[f"{name}/{k}/bias"] = (width,)
    for name, width in _norms():
        result |= {f"{name}/gain": (width,), f"{name}/shift": (width,)}
    return result | {"colour/weight": (3, CHANNELS * SCALES, 1, 1, 1), "colour/bias": (3,)}


def statistic_shapes() -> dict[str, tuple[int, ...]]:
    """Shapes of the running statistics by name."""
    return {f"{name}/{kind}": (width,) for name, width in _norms() for kind in ("mean", "variance")}


def _blocks() -> Iterator[tuple[str, int, int]]:
    """Names of the blocks, channels that they give and that they take."""
    for scale in range(SCALES):
        yield f"noise{scale}", CHANNELS, NOISE
    for scale in range(SCALES - 1):
        width = CHANNELS * (SCALES - scale)
        yield f"join{scale}", width, width


def _norms() -> Iterator[tuple[str, int]]:
    """Names of the batch normalisations, and their channels."""
    for name, width, _ in _blocks():
        yield from ((f"{name}/{k}", width) for k in range(len(KERNELS)))
    for scale in range(SCALES - 1):
        yield f"up{scale}", CHANNELS * (SCALES - 1 - scale)
