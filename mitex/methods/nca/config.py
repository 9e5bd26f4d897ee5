"""Settings of the image-guided MeshNCA training, and its presets."""

from __future__ import annotations

from dataclasses import dataclass

from mitex.errors import ConfigError
from mitex.features.vgg import LAYERS
from mitex.training import check_ranges

VIEWS = ("full", "patch")


@dataclass(frozen=True)
class NcaConfig:
    """Everything that shapes a training; every key can be set from a TOML file or `--set`.

    Attributes:
        steps, seed, preset: as in every method.
        channels, hidden, degree: of the model (see `MeshNCA`).
        gain: of the initial weights of the last layer (the authors: 1.2, from which states overflow for the
            first 100 steps).
        frequency: of the icosphere that the rule is trained on; 10 f^2 + 2 vertices.
        pool: states kept between steps.
        inject_every: every so many steps the drawn state is replaced by the seed.
        min_steps, max_steps: of the automaton in a training step, both inclusive.
        views: "full" (the paper: perspective views of the whole sphere) or "patch" (orthographic close-ups).
        view_count: views of a step.
        resolution: of a view [px].
        distance, fov: of full views [normalised mesh units, degrees].
        density: patch views: vertices along the width of the exemplar. Sets the size of the texture on a
            mesh.
        exemplar_size: the exemplar is resized to it [px].
        target_size: the resized exemplar is enlarged to it for the features [px] (the authors: 128, then
            224).
        blend: False gives every map to the features by itself in every view (the paper); True gives each
            view one picture: the albedo, the normals, the grey maps packed into one, or channels of
            different maps mixed, so that maps are learned in register.
        layers: of VGG-16.
        pooling: "average" or "max".
        samples: feature vectors compared in each layer and view, at most.
        colour_weight: of the comparison of colours, beside the feature layers.
        colour_histogram: compare the histograms of the channels too.
        moment_weight: of the moment terms, beside the transport terms.
        appearance_weight, overflow_weight: of the two parts of the loss.
        lr, milestones, decay: Adam and its schedule.
        normalise_gradients: divide each parameter tensor's gradient by its norm.
        checkpoint_every, preview_every: in steps.
    """

    steps: int
    preset: str
    seed: int = 0
    channels: int = 16
    hidden: int = 128
    degree: int = 1
    gain: float = 1.2
    frequency: int = 64
    pool: int = 256
    inject_every: int = 16
    min_steps: int = 15
    max_steps: int = 24
    views: str = "full"
    view_count: int = 6
    resolution: int = 320
    distance: float = 2.5
    fov: float = 60.0
    density: float = 98.0
    exemplar_size: int = 128
    target_size: int = 224
    blend: bool = False
    layers: tuple[str, ...] = (
        *("relu1_1", "relu1_2", "relu2_1", "relu2_2", "relu3_1", "relu3_2", "relu3_3"),
        *("relu4_3", "relu5_3"),
    )
    pooling: str = "average"
    samples: int = 1024
    colour_weight: float = 1.0
    colour_histogram: bool = False
    moment_weight: float = 0.1
    appearance_weight: float = 2.0
    overflow_weight: float = 1e4
    lr: float = 1e-3
    milestones: tuple[int, ...] = (1000, 2000)
    decay: float = 0.3
    normalise_gradients: bool = True
    checkpoint_every: int = 100
    preview_every: int = 100

    def __post_init__(self) -> None:
        positive = ("hidden", "frequency", "pool", "inject_every", "min_steps", "view_count", "samples")
        counts = {key: (1, 4096) for key in positive}
        check_ranges(
            self,
            **counts,
            steps=(0, None),
            channels=(12, 256),
            degree=(0, 2),
            resolution=(16, 2048),
            exemplar_size=(16, 2048),
            target_size=(16, 2048),
            distance=(1.01, 100),
            fov=(1, 170),
            density=(4, 4096),
            colour_weight=(0, None),
            moment_weight=(0, None),
            appearance_weight=(0, None),
            overflow_weight=(0, None),
            lr=(0, None),
            decay=(0, None),
            checkpoint_every=(1, None),
            preview_every=(0, None),
            max_steps=(self.min_steps, 4096),
        )
        if self.views not in VIEWS:
            raise ConfigError(f"views = '{self.views}' is unknown", f"use one of {', '.join(VIEWS)}")
        if self.pooling not in ("average", "max"):
            raise ConfigError(f"pooling = '{self.pooling}' is unknown", "use average or max")
        unknown = [layer for layer in self.layers if layer not in LAYERS]
        if unknown or not self.layers:
            raise ConfigError(f"layers holds {unknown or 'nothing'}", f"use some of {', '.join(LAYERS)}")


PRESETS = {
    "patch": NcaConfig(
        steps=1000,
        preset="patch",
        gain=0.1,
        frequency=48,
        pool=64,
        min_steps=20,
        max_steps=32,
        views="patch",
        view_count=8,
        resolution=64,
        density=96.0,
        target_size=128,
        blend=True,
        colour_weight=10.0,
        colour_histogram=True,
        milestones=(750, 900),
    ),
    "paper": NcaConfig(steps=4000, preset="paper"),
}
