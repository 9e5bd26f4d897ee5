"""Settings of the geometric texture network."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from mitex.errors import ConfigError
from mitex.methods.option_types import TextOf
from mitex.training.settings import DeviceConfig, key

MAX_LEVELS = 7  # 0 to 6
Placement = Literal["even", "none"]  # of bumps, before the first generator; see `placement`

# A file, a shape by formula, or an embedded mesh.
ReferenceName = Annotated[str, TextOf(names="mitex.methods.geometric.references:reference_names")]


@dataclass(frozen=True)
class GeometricConfig(DeviceConfig):
    """Settings of a fit; every key can be set from a TOML file or with `--set`."""

    preset: str = "fast"
    steps: int = key(10_000, "steps of the generators, all levels together; more add levels", 1)
    level_steps: int = key(2_000, "steps on each level", 1)
    critic_steps: int = key(2, "steps of a critic", 1, 100)
    generator_steps: int = key(3, "steps of a generator that take turns with them", 1, 100)
    first_level: int = key(
        0,
        "level of the training meshes on which generators begin: for features of a few edges, on that where "
        "they are about four edges wide; 0 (the paper): on the coarsest",
        0,
        MAX_LEVELS - 1,
    )
    noise: float = key(0.1, "standard deviation of what is added to the vertices [mean edges]", 0, 10)
    reconstruction: float = key(5.0, "weight of the distance from the training mesh", 0)
    penalty: float = key(0.1, "weight of the gradient penalty", 0)
    lr: float = key(5e-4, "learning rate at the beginning of each level, halved after each quarter", 0, 1)
    beta1: float = key(0.5, "Adam's decay of the first moment", 0, 0.9999)
    beta2: float = key(0.99, "Adam's decay of the second moment", 0, 0.9999)
    remeasure: bool = key(False, "measure the mean edge on each level, instead of carrying it from the first")
    symmetric: bool = key(False, "whether the relief looks alike from both ends of its field")
    # Levels 0 to 2 have networks of different widths, see `model.WIDTHS`.
    carried: int = key(3, "first level whose networks start from those of the level before", 3, MAX_LEVELS)
    fit_steps: int = key(600, "steps of fitting each training mesh to the reference", 1)
    fit_samples: int = key(3_000, "points on each surface, times the level's number + 1", 100, 1_000_000)
    fit_lr: float = key(0.02, "how far a step moves a vertex [mean edges]", 0, 1)
    fit_normals: float = key(0.1, "weight of the normals beside the distances, in both directions", 0)
    fit_uniform: float = key(0.05, "weight of the deviation of edge lengths", 0)
    fit_entropy: float = key(0.005, "weight of the evenness of the sides of each face", 0)
    fit_blur: float = key(
        0.0,
        "width of the low-pass filter that the reference goes through first [mean edges]: with 1, waves of "
        "4.4 edges are halved; 0 (the paper): none",
        0,
        10,
    )
    fit_smooth: float = key(0.02, "weight of the distance from the mean of the neighbours", 0)
    checkpoint_every: int = 200
    preview_every: int = 1_000

    def __post_init__(self) -> None:
        super().__post_init__()
        most = MAX_LEVELS - self.first_level
        if self.levels > most:
            raise ConfigError(
                f"{self.steps} steps at {self.level_steps} a level are {self.levels} levels",
                f"set steps to {most * self.level_steps} or less",
            )

    @property
    def levels(self) -> int:
        """How many levels of generators the steps reach."""
        return -(-self.steps // self.level_steps)


DEFAULT = GeometricConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(DEFAULT, preset="paper", steps=30_000, level_steps=6_000),
    "fine": replace(DEFAULT, preset="fine", steps=2_000, level_steps=1_000, first_level=4, fit_blur=1.0),
    "finest": replace(DEFAULT, preset="finest", steps=1_000, level_steps=1_000, first_level=5, fit_blur=0.5),
}
