"""Settings of Text2Mesh, and its presets: for an image, and for words."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.features.layers import check_layers
from mitex.methods.layout import exemplar_texels
from mitex.methods.neural_style.config import EMBEDDED, PUBLISHED_WEIGHTS, StyleConfig
from mitex.training.settings import key


@dataclass(frozen=True)
class Text2MeshConfig(StyleConfig):
    """Everything that shapes a training; every key can be set from a TOML file or with `--set`."""

    steps: int = 400
    exemplar_size: int = key(
        0, "side of the exemplar's central square on the mesh [texels]; 0: half of the resolution", 0, 2048
    )
    layers: tuple[str, ...] = key(
        ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1"), "VGG-16's that are compared"
    )
    pooling: Literal["average", "max"] = key("max", "pooling of VGG-16")
    samples: int = key(1024, "feature vectors a layer and picture", 1)
    colour_histogram: bool = key(True, "compare the histograms of the channels too")
    moment_weight: float = key(0.1, "weight of the moments of features", 0)
    open_waves: int = key(
        0, "steps in which the waves are opened, the slowest first; 0: all are open from the start", 0
    )
    preview_every: int = 50

    def __post_init__(self) -> None:
        super().__post_init__()
        exemplar_texels(self.exemplar_size, self.resolution)
        check_layers(self.layers)


def share_open(config: Text2MeshConfig, step: int | None) -> float:
    """The share of the waves that is open at a step; of all of them after the training (None)."""
    return 1.0 if step is None or step >= config.open_waves else step / config.open_waves


DEFAULT = Text2MeshConfig()
PAPER = replace(
    DEFAULT,
    preset="paper",
    steps=1500,
    layers=(
        *("relu1_1", "relu1_2", "relu2_1", "relu2_2", "relu3_1", "relu3_2", "relu3_3"),
        *("relu4_3", "relu5_3"),
    ),
    pooling="average",
    colour_histogram=False,
    sigma=5.0,
    views=5,
    cameras="anchored",
    milestones=tuple(range(100, 1500, 100)),
    open_waves=87,
)
WORDS = replace(DEFAULT, text="red dots on white")
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": PAPER,
    "text": replace(
        WORDS,
        preset="text",
        steps=600,
        sigma=5.0,
        views=4,
        cameras="anchored",
        milestones=tuple(range(100, 600, 100)),
        text_crops=2,
        **PUBLISHED_WEIGHTS,
    ),
    "text-words": replace(WORDS, preset="text-words", sigma=3.0, **EMBEDDED),
    "text-paper": replace(PAPER, preset="text-paper", text=WORDS.text, **PUBLISHED_WEIGHTS),
}
