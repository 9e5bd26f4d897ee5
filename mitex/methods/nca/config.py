"""Settings of the image-guided MeshNCA training, and its presets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.features.layers import LAYERS
from mitex.training.settings import TrainingConfig, key


@dataclass(frozen=True)
class NcaConfig(TrainingConfig):
    """Everything that shapes a training; every key can be set from a TOML file or with `--set`."""

    preset: str = "patch"
    steps: int = key(1000, "training steps", 0)
    channels: int = key(16, "channels of a cell's state", 12, 256)
    hidden: int = key(128, "width of the hidden layer", 1, 4096)
    degree: int = key(1, "highest degree of the spherical harmonics of the perception", 0, 2)
    gain: float = key(0.1, "gain of the initial weights of the last layer (the authors: 1.2)", 0)
    frequency: int = key(48, "of the icosphere that is trained on; 10 f^2 + 2 vertices", 1, 4096)
    pool: int = key(64, "states kept between steps", 1, 4096)
    inject_every: int = key(16, "steps after which the drawn state is replaced by the seed", 1, 4096)
    min_steps: int = key(20, "fewest automaton steps in a training step", 1, 4096)
    max_steps: int = key(32, "most automaton steps in a training step", 1, 4096)
    views: Literal["patch", "full"] = key(
        "patch", "orthographic close-ups, or perspective views of the whole sphere (the paper)"
    )
    view_count: int = key(8, "views in a step", 1, 4096)
    resolution: int = key(64, "side of a view [px]", 16, 2048)
    distance: float = key(2.5, "of the camera of a full view [normalised mesh units]", 1.01, 100)
    fov: float = key(60.0, "field of view of a full view [degrees]", 1, 170)
    density: float = key(96.0, "vertices along the exemplar's width in a patch: the size on a mesh", 4, 4096)
    exemplar_size: int = key(128, "side that the exemplar is resized to [px]", 16, 2048)
    target_size: int = key(128, "side that it is enlarged to for the features [px]", 16, 2048)
    blend: bool = key(
        True, "a view shows one picture of several maps, mixed, so that they are learned in register"
    )
    layers: tuple[str, ...] = key(
        (
            *("relu1_1", "relu1_2", "relu2_1", "relu2_2", "relu3_1", "relu3_2", "relu3_3"),
            *("relu4_3", "relu5_3"),
        ),
        "of VGG-16",
    )
    pooling: Literal["average", "max"] = key("average", "of VGG-16")
    samples: int = key(1024, "feature vectors compared in each layer and view, at most", 1, 4096)
    colour_weight: float = key(1.0, "of the comparison of colours, beside the layers", 0)
    colour_histogram: bool = key(True, "compare the histograms of the channels too")
    moment_weight: float = key(0.1, "of the moment terms, beside the transport terms", 0)
    appearance_weight: float = key(2.0, "of the appearance loss", 0)
    overflow_weight: float = key(1e4, "of the overflow loss", 0)
    lr: float = key(1e-3, "Adam's learning rate", 0)
    milestones: tuple[int, ...] = key((750, 900), "steps at which the learning rate falls", 0)
    decay: float = key(0.3, "factor of the learning rate at a milestone", 0)
    normalise_gradients: bool = key(True, "divide each parameter tensor's gradient by its norm")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.max_steps < self.min_steps:
            raise ConfigError(
                f"max_steps = {self.max_steps} is out of range", f"choose {self.min_steps} or more"
            )
        unknown = [layer for layer in self.layers if layer not in LAYERS]
        if unknown or not self.layers:
            raise ConfigError(f"layers holds {unknown or 'nothing'}", f"use some of {', '.join(LAYERS)}")


DEFAULT = NcaConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(
        DEFAULT,
        preset="paper",
        steps=4000,
        gain=1.2,
        frequency=64,
        pool=256,
        min_steps=15,
        max_steps=24,
        views="full",
        view_count=6,
        resolution=320,
        density=98.0,
        target_size=224,
        blend=False,
        colour_histogram=False,
        milestones=(1000, 2000),
    ),
}
