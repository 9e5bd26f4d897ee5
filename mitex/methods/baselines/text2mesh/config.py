"""Settings of Text2Mesh with an image, and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.features.layers import check_layers
from mitex.training.settings import TrainingConfig, key


@dataclass(frozen=True)
class Text2MeshConfig(TrainingConfig):
    """Everything that shapes a training; every key can be set from a TOML file or with `--set`."""

    steps: int = 400
    resolution: int = key(512, "side of the texture that the network is baked into [texels]", 16, 4096)
    exemplar_size: int = key(
        256, "side of the exemplar's central square on the mesh [texels], as of surface", 32, 2048
    )
    frequencies: int = key(256, "random waves of the place that the network reads", 1, 4096)
    sigma: float = key(12.0, "spread of their frequencies [cycles a radius]; the paper: 5", 0.01, 1000)
    width: int = key(256, "of the network's layers", 1, 4096)
    views: int = key(2, "pictures in a step; the paper: 5", 1, 64)
    cameras: Literal["around", "anchored"] = key(
        "around", "uniformly in all directions, or around the front (the paper)"
    )
    view: int = key(224, "side of a picture [px]", 32, 2048)
    fov: float = key(60.0, "field of view [degrees]", 1, 120)
    distance: float = key(2.0, "of the cameras [radii]", 1.01, 1000)
    layers: tuple[str, ...] = key(
        ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"), "VGG-16's that are compared"
    )
    samples: int = key(1024, "feature vectors a layer and picture", 1)
    moment_weight: float = key(0.1, "weight of the moments", 0)
    lr: float = key(5e-4, "learning rate of Adam", 0)
    milestones: tuple[int, ...] = key((100, 200, 300), "steps at which the learning rate falls", 0)
    decay: float = key(0.9, "factor of the learning rate at a milestone", 0)
    preview_every: int = 50

    def __post_init__(self) -> None:
        super().__post_init__()
        check_layers(self.layers)


DEFAULT = Text2MeshConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(
        DEFAULT,
        preset="paper",
        steps=1500,
        sigma=5.0,
        views=5,
        cameras="anchored",
        milestones=tuple(range(100, 1500, 100)),
    ),
}
