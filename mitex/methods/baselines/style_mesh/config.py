"""Settings of StyleMesh, and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.features.layers import NETWORKS, check_layers
from mitex.methods.layout import exemplar_texels
from mitex.training.settings import ScheduledConfig, key

LEAST_SIDE = 64  # of the exemplar, of which half is looked at, too [px]


@dataclass(frozen=True)
class StyleMeshConfig(ScheduledConfig):
    """Everything that shapes a synthesis; every key can be set from a TOML file or with `--set`."""

    steps: int = 480
    resolution: int = key(512, "side of the texture [texels]", 32, 4096)
    textures: int = key(4, "textures whose sum is the result, each half as fine as the one before", 1, 6)
    exemplar_size: int = key(
        0, "side of the exemplar's central square on the mesh [texels]; 0: half of the resolution", 0, 2048
    )
    views: int = key(24, "cameras, evenly around the mesh", 1, 10_000)
    view: int = key(256, "height of the lowest pictures [px]", 64, 2048)
    heights: int = key(2, "heights of pictures, each twice as high as the one before; the paper: 4", 1, 5)
    distance: float = key(2.5, "distance of the cameras [half extents of the mesh]", 1.01, 1000)
    fov: float = key(60.0, "field of view [degrees]", 1, 120)
    antialias: int = key(2, "n for n x n rays per pixel; the paper: 1", 1, 8)
    by_depth: bool = key(True, "a pixel counts in the pictures in which it is as large as a texel")
    by_angle: bool = key(
        False,
        "pixels count by the cosine of the angle they are seen at, and small details where it is small; "
        "the paper: true",
    )
    frontal: float = key(
        30.0, "with by_angle: the angle up to which small details are added [degrees]", 0, 90
    )
    network: Literal["vgg16", "vgg19"] = key(
        "vgg16", "whose features are compared; vgg19 (the paper) is a file of yours (mitex.features.vgg19)"
    )
    layers: tuple[str, ...] = key(
        ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"), "layers of the network that are compared"
    )
    weights: tuple[float, ...] = key((0.1, 0.1, 0.001, 0.001, 0.1), "weights of the layers", 0)
    small_layers: tuple[str, ...] = key(
        ("relu4_1", "relu5_1"),
        "with by_angle: layers that are compared with the exemplar at half its size, too",
    )
    clamped: bool = key(
        True, "views show the sum of the textures clamped to [0, 1], as it is saved; the paper: unclamped"
    )
    coarse_first: float = key(
        3.25e8, "how much finer textures are held near zero, so that coarse ones take what they can", 0
    )
    lr: float = key(0.01, "learning rate of Adam [of the colours' range]; the paper: a level of 8 bits", 0)
    milestones: tuple[int, ...] = (206, 411)
    preview_every: int = 60

    def __post_init__(self) -> None:
        super().__post_init__()
        exemplar_texels(self.exemplar_size, self.resolution, LEAST_SIDE)
        check_layers(self.layers, NETWORKS[self.network])
        if len(self.weights) != len(self.layers):
            raise ConfigError(
                f"{len(self.weights)} weights for {len(self.layers)} layers", "give one for each"
            )
        if unknown := set(self.small_layers) - set(self.layers):
            raise ConfigError(
                f"small_layers holds {', '.join(sorted(unknown))}", f"use some of {', '.join(self.layers)}"
            )
        if self.resolution % 2 ** (self.textures - 1):
            raise ConfigError(
                f"{self.textures} textures of {self.resolution} texels",
                f"use a multiple of {2 ** (self.textures - 1)}",
            )


DEFAULT = StyleMeshConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(
        DEFAULT,
        preset="paper",
        steps=14_000,
        resolution=4096,
        views=100,
        heights=4,
        antialias=1,
        by_angle=True,
        clamped=False,
        lr=0.004,
        milestones=(6000, 12_000),
    ),
}
