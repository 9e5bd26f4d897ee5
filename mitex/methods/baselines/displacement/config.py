"""Settings of the displacement maps."""

from __future__ import annotations

from dataclasses import dataclass

from mitex.training.settings import FitConfig, key

SUBDIVISIONS = (0, 6)  # in which every face of a mesh is split in four


@dataclass(frozen=True)
class DisplacementConfig(FitConfig):
    """Settings of a height map; every key can be set from a TOML file or with `--set`."""

    resolution: int = key(256, "side of the height map [texels]", 8, 4096)
    window: float = key(0.35, "side of the square that is taken off [of the reference's extent]", 0.01, 1)


DEFAULT = DisplacementConfig()
PRESETS = {DEFAULT.preset: DEFAULT}
