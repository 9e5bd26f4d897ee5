"""Settings of solid textures, and their presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.features.layers import NETWORKS, check_layers
from mitex.methods.layout import EXEMPLAR_WIDTH
from mitex.training.settings import ScheduledConfig, key


@dataclass(frozen=True)
class SolidConfig(ScheduledConfig):
    """Everything that shapes a training; every key can be set from a TOML file or with `--set`."""

    steps: int = 600
    exemplar_size: int = key(256, "side of the exemplar [voxels]", 32, 1024)
    width: float = key(
        EXEMPLAR_WIDTH, "side of the exemplar on a mesh, of that of a layout's square", 0.01, 10
    )
    slice_size: int = key(128, "side of the slices that are compared [voxels]", 32, 512)
    slices: int = key(1, "slices across each axis in a step; the paper: 8", 1, 64)
    network: Literal["vgg16", "vgg19"] = key(
        "vgg16", "whose features are compared; vgg19 (the paper) is a file of yours (mitex.features.vgg19)"
    )
    layers: tuple[str, ...] = key(
        ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"), "whose Gram matrices are compared"
    )
    normalised: bool = key(
        True,
        "layers are divided by their mean activations, so that they count alike; the paper: not, and Gram "
        "matrices are divided by how many channels there are",
    )
    lr: float = 0.1
    milestones: tuple[int, ...] = (400, 500)
    decay: float = key(0.3, "factor of the learning rate at a milestone; the paper: 1", 0)
    preview_every: int = 50

    def __post_init__(self) -> None:
        super().__post_init__()
        check_layers(self.layers, NETWORKS[self.network])
        if self.network == "vgg19" and self.normalised:
            raise ConfigError("the mean activations of VGG-19 are not known", "set normalised=false")


DEFAULT = SolidConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(DEFAULT, preset="paper", steps=3000, slices=8, normalised=False, milestones=()),
}
