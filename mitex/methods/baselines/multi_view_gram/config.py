"""Settings of the textures that are optimized through views, and their presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.features.layers import NETWORKS, check_layers
from mitex.methods.layout import exemplar_texels
from mitex.training.settings import TrainingConfig, key


@dataclass(frozen=True)
class MultiViewConfig(TrainingConfig):
    """Everything that shapes a synthesis; every key can be set from a TOML file or with `--set`."""

    steps: int = 400
    resolution: int = key(512, "side of the texture [texels]", 16, 4096)
    exemplar_size: int = key(
        0, "side of the exemplar's central square on the mesh [texels]; 0: half of the resolution", 0, 2048
    )
    view: int = key(256, "side of the picture that a step compares [px]", 32, 2048)
    fov: float = key(10.0, "field of view [degrees]", 1, 120)
    nearest: float = key(10.0, "nearest camera [half extents of the mesh]", 1.01, 1000)
    farthest: float = key(12.0, "farthest camera [half extents of the mesh]", 1.01, 1000)
    antialias: int = key(2, "n for n x n rays per pixel; the paper: 1", 1, 8)
    masked: bool = key(
        True, "Gram matrices are of what shows the mesh; the paper: of the black background, too"
    )
    network: Literal["vgg16", "vgg19"] = key(
        "vgg16",
        "in the place of Inception V1 (the paper); vgg19, as of those who compared with it, is a file of "
        "yours (mitex.features.vgg19)",
    )
    layers: tuple[str, ...] = key(
        ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"), "the network's that are compared"
    )
    memory: float = key(0.95, "decay of the moving average of the Gram matrices", 0, 0.9999)
    content_layer: str = key("relu4_1", "whose features stay the content's")
    content_weight: float = key(100.0, "how much that counts", 0)
    lr: float = key(0.05, "learning rate of Adam", 0)
    preview_every: int = 50

    def __post_init__(self) -> None:
        super().__post_init__()
        exemplar_texels(self.exemplar_size, self.resolution)
        for layers in (self.layers, [self.content_layer]):
            check_layers(layers, NETWORKS[self.network])
        if self.nearest > self.farthest:
            raise ConfigError(f"nearest = {self.nearest:g} is beyond farthest", "set it to less")


DEFAULT = MultiViewConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(DEFAULT, preset="paper", resolution=1024, view=512, antialias=1, masked=False),
}
