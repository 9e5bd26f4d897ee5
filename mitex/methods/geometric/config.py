"""Settings of the geometric texture network."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mitex.errors import ConfigError
from mitex.training.config import check_ranges

MAX_LEVELS = 7  # 0 to 6


@dataclass(frozen=True)
class GeometricConfig:
    """Settings of a fit; keys as in `--set key=value`.

    Attributes:
        preset: its name.
        steps: of the generators, all levels together; more add levels.
        level_steps: of them for each level.
        seed: of all randomness.
        critic_steps, generator_steps: how many of each take turns.
        noise: standard deviation of what is added to the vertices [mean edges].
        reconstruction: weight of the distance from the training mesh.
        penalty: weight of the gradient penalty.
        lr: learning rate, halved four times on each level.
        beta1, beta2: of Adam.
        remeasure: measure the mean edge on each level, instead of carrying it from the first.
        carried: first level whose networks start from those of the level before; from level 3 on they are
            of one size.
        fit_steps: of the optimisation of each training mesh.
        fit_samples: points on each surface, times the level's number + 1.
        fit_lr: how far a step moves a vertex [mean edges].
        fit_normals: weight of the normals beside the distances, in both directions.
        fit_uniform: weight of the deviation of edge lengths.
        fit_entropy: weight of the evenness of the sides of each face.
        fit_smooth: weight of the distance from the mean of the neighbours.
        checkpoint_every, preview_every: steps between them.
    """

    preset: str = "fast"
    steps: int = 30_000
    level_steps: int = 6_000
    seed: int = 0
    critic_steps: int = 2
    generator_steps: int = 3
    noise: float = 0.1
    reconstruction: float = 5.0
    penalty: float = 0.1
    lr: float = 5e-4
    beta1: float = 0.5
    beta2: float = 0.99
    remeasure: bool = False
    carried: int = 3
    fit_steps: int = 600
    fit_samples: int = 3_000
    fit_lr: float = 0.02
    fit_normals: float = 0.1
    fit_uniform: float = 0.05
    fit_entropy: float = 0.005
    fit_smooth: float = 0.02
    checkpoint_every: int = 200
    preview_every: int = 1_000

    def __post_init__(self) -> None:
        check_ranges(
            self,
            steps=(1, None),
            level_steps=(1, None),
            seed=(0, 2**32 - 1),
            critic_steps=(1, 100),
            generator_steps=(1, 100),
            noise=(0, 10),
            reconstruction=(0, None),
            penalty=(0, None),
            lr=(0, 1),
            beta1=(0, 0.9999),
            beta2=(0, 0.9999),
            carried=(3, MAX_LEVELS),
            fit_steps=(1, None),
            fit_samples=(100, 1_000_000),
            fit_lr=(0, 1),
            fit_normals=(0, None),
            fit_uniform=(0, None),
            fit_entropy=(0, None),
            fit_smooth=(0, None),
            checkpoint_every=(1, None),
            preview_every=(0, None),
        )
        if self.levels > MAX_LEVELS:
            raise ConfigError(
                f"{self.steps} steps at {self.level_steps} a level are {self.levels} levels",
                f"set steps to {MAX_LEVELS * self.level_steps} or less",
            )

    @property
    def levels(self) -> int:
        """How many levels the steps reach."""
        return -(-self.steps // self.level_steps)


PRESETS = {
    "fast": replace(GeometricConfig(), steps=10_000, level_steps=2_000),
    "paper": replace(GeometricConfig(), preset="paper"),
}
