"""Settings of reliefs from pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from mitex.features.layers import check_layers
from mitex.methods.surface.config import DEFAULT as SURFACE
from mitex.methods.surface.config import SurfaceConfig
from mitex.ranges import SCALES
from mitex.training.settings import ScheduledConfig, key


@dataclass(frozen=True)
class ReliefConfig(ScheduledConfig):
    """Everything that shapes a fit; every key can be set from a TOML file or with `--set`."""

    steps: int = 100
    start: Literal["surface", "flat"] = key(
        "surface",
        "begin with maps that surface synthesizes, or with the mesh as it is, without colours",
    )
    resolution: int = key(SURFACE.resolution, "side of the maps [texels]", 16, 4096)
    scale: float = key(1.0, "size of the pattern, as of surface", *SCALES)
    surface_steps: int = key(SURFACE.steps, "steps of surface", 1)
    faces: int = key(
        200_000, "faces of the relief, about: half to twice as many, or fewer for coarse maps", 1, 2_000_000
    )
    depth: float = key(
        0.0,
        "depth of the relief, from black to white in the height map [widths of the exemplar]; 0: what the "
        "exemplar's normals say",
        0,
        1,
    )
    views: int = key(4, "close-ups in a step", 1, 64)
    view: int = key(128, "side of a close-up [px]", 32, 2048)
    width: float = key(
        0.0,
        "width of what a close-up shows [widths of the exemplar]; 0: as many edges of the relief as it has "
        "pixels, since vertices cannot follow finer detail",
        0,
        16,
    )
    loss: Literal["transport", "gram"] = key(
        "transport", "relaxed transport and moments of features, or their Gram matrices"
    )
    layers: tuple[str, ...] = key(("relu1_1", "relu2_1", "relu3_1", "relu4_1"), "VGG-16's that are compared")
    samples: int = key(2048, "feature vectors of a layer and a kind of picture, for transport", 2)
    moment_weight: float = key(0.1, "weight of the moments, for transport", 0)
    joint: bool = key(True, "also compare pictures that mix heights, normals and colours")
    sideways: float = key(1.0, "how easily vertices move along the surface; 0: along normals only", 0, 10)
    smoothing: float = key(16.0, "how far a vertex takes others along (Nicolet et al. 2021, lambda)", 0, 1e4)
    lr: float = key(1e-3, "learning rate of Adam [widths of the exemplar]", 0)
    milestones: tuple[int, ...] = (75,)
    checkpoint_every: int = 50
    preview_every: int = 50

    def __post_init__(self) -> None:
        super().__post_init__()
        check_layers(self.layers)
        self.exemplar_side  # noqa: B018 - refuses a scale that the exemplar cannot have

    @property
    def of_surface(self) -> dict[str, Any]:
        """The settings of the fit that synthesizes the maps."""
        own = ("resolution", "scale", "seed")
        return {name: getattr(self, name) for name in own} | {"steps": self.surface_steps}

    @property
    def exemplar_side(self) -> int:
        """Of the exemplar on the maps [texels].

        Raises:
            ConfigError: it cannot be that small or large.
        """
        return SurfaceConfig(resolution=self.resolution, scale=self.scale).exemplar_side()


DEFAULT = ReliefConfig()
PRESETS = {DEFAULT.preset: DEFAULT}
