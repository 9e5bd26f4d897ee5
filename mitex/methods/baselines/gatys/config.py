"""Settings of flat pictures that are optimized by Gram matrices, and their presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.features.layers import NETWORKS, check_layers, halvings, with_poolings
from mitex.training.settings import TrainingConfig, key


@dataclass(frozen=True)
class GatysConfig(TrainingConfig):
    """Everything that shapes a synthesis; every key can be set from a TOML file or with `--set`."""

    steps: int = 2000
    size: int = key(256, "side of the picture [px]", 32, 4096)
    resolution: int = key(512, "pixels along the side of a layout's square; texels as of surface", 16, 4096)
    exemplar_size: int = key(
        256, "side that the exemplar's central square is resized to [px]; a pixel becomes a texel", 32, 2048
    )
    noise: float = key(
        0.0136,
        "share of noise in the start, in which the exemplar's mean colour has the rest; by default, as the "
        "paper's authors have it: as wide as noise with a standard deviation of a level of 8 bits",
        0,
        1,
    )
    periodic: bool = key(False, "the picture goes on beyond its borders; the paper: zeros are around it")
    network: Literal["vgg16", "vgg19"] = key(
        "vgg16", "whose features are compared; vgg19 (the paper) is a file of yours (mitex.features.vgg19)"
    )
    layers: tuple[str, ...] = key(
        ("relu1_1", "pool1", "pool2", "pool3", "pool4"),
        "convolutions and poolings that are compared; as in the paper, the first, and four poolings",
    )
    optimizer: Literal["lbfgs", "adam"] = key("lbfgs", "L-BFGS (the paper) or Adam")
    lr: float = key(0.2, "the largest change in a step of L-BFGS, or the learning rate of Adam", 0)
    preview_every: int = 200

    def __post_init__(self) -> None:
        super().__post_init__()
        check_layers(self.layers, with_poolings(NETWORKS[self.network]))
        cell = 1 << max(map(halvings, self.layers))
        if self.size % cell:
            problem = f"a picture of {self.size} pixels"
            raise ConfigError(problem, f"use a multiple of {cell}, which can be halved")


DEFAULT = GatysConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(DEFAULT, preset="paper"),
}
