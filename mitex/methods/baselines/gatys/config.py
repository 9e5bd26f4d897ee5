"""Settings of flat pictures that are optimized by Gram matrices, and their presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.features.layers import check_layers
from mitex.training.settings import TrainingConfig, key


@dataclass(frozen=True)
class GatysConfig(TrainingConfig):
    """Everything that shapes a synthesis; every key can be set from a TOML file or with `--set`."""

    steps: int = 300
    size: int = key(512, "side of the picture [px]", 32, 4096)
    resolution: int = key(512, "pixels along the side of a layout's square; texels as of surface", 16, 4096)
    exemplar_size: int = key(
        256, "side that the exemplar's central square is resized to [px]; a pixel becomes a texel", 32, 2048
    )
    noise: float = key(
        0.1, "of the start, in which the exemplar's mean colour has the rest; the paper: 1", 0, 1
    )
    periodic: bool = key(True, "the picture goes on beyond its borders; the paper: zeros are around it")
    layers: tuple[str, ...] = key(
        ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"), "VGG-16's that are compared"
    )
    optimizer: Literal["lbfgs", "adam"] = key("lbfgs", "L-BFGS (the paper) or Adam")
    lr: float = key(0.2, "of L-BFGS the largest change in a step; of Adam the learning rate", 0)
    preview_every: int = 50

    def __post_init__(self) -> None:
        super().__post_init__()
        check_layers(self.layers)
        if self.size % 16:
            raise ConfigError(f"a picture of {self.size} pixels", "use a multiple of 16, which can be halved")


DEFAULT = GatysConfig()
PRESETS = {DEFAULT.preset: DEFAULT, "paper": replace(DEFAULT, preset="paper", noise=1.0, periodic=False)}
