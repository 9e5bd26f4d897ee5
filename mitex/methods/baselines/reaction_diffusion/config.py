"""Settings of reaction-diffusion textures, and their presets."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mitex.errors import ConfigError
from mitex.features.layers import check_layers
from mitex.training.settings import ScheduledConfig, key

STABLE = 0.125  # rate of diffusion up to which no explicit step overshoots, see `laplacian`


@dataclass(frozen=True)
class ReactionDiffusionConfig(ScheduledConfig):
    """Everything that shapes a training; every key can be set from a TOML file or with `--set`."""

    steps: int = 4000
    channels: int = key(32, "chemicals; the first three are red, green and blue", 3, 256)
    hidden: int = key(128, "width of the hidden layer of the reaction", 1, 4096)
    slowest: float = key(0.008, "rate of diffusion of the first chemical [cells^2 a step]", 0, STABLE)
    fastest: float = key(STABLE, "rate of the last one; those between grow evenly in ratio", 1e-6, STABLE)
    grid: int = key(128, "side of the square that is trained on, whose borders are joined [cells]", 16, 1024)
    exemplar_size: int = key(128, "side of the exemplar [cells]", 16, 1024)
    width: float = key(
        0.5, "side of the exemplar on a mesh, of that of a layout's square: surface's 256 of 512", 0.01, 10
    )
    pool: int = key(16, "states kept between steps", 1, 4096)
    inject_every: int = key(8, "steps after which the drawn state is replaced by a new start", 1, 4096)
    min_steps: int = key(24, "fewest steps of time in a training step", 1, 4096)
    max_steps: int = key(40, "most steps of time in a training step", 1, 4096)
    layers: tuple[str, ...] = key(
        ("relu1_1", "relu2_1", "relu3_1", "relu4_1"), "VGG-16's whose Gram matrices are compared"
    )
    overflow_weight: float = key(100.0, "weight of the overflow loss", 0)
    lr: float = 1e-3
    milestones: tuple[int, ...] = (2400, 3400)
    decay: float = 0.3

    def __post_init__(self) -> None:
        super().__post_init__()
        check_layers(self.layers)
        if self.max_steps < self.min_steps:
            raise ConfigError(f"max_steps = {self.max_steps}", f"choose {self.min_steps} or more")


DEFAULT = ReactionDiffusionConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(
        DEFAULT,
        preset="paper",
        steps=20_000,
        pool=256,
        min_steps=32,
        max_steps=64,
        milestones=(10_000, 15_000),
    ),
}
