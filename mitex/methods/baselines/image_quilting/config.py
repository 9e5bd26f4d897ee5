"""Settings of quilted pictures, and their presets."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mitex.errors import ConfigError
from mitex.training.settings import FitConfig, key

OVERLAP = 6  # of so many parts of a block, one overlaps the neighbour


@dataclass(frozen=True)
class QuiltingConfig(FitConfig):
    """Settings of a quilted picture; every key can be set from a TOML file or with `--set`."""

    size: int = key(512, "side of the picture [px]", 16, 4096)
    resolution: int = key(512, "pixels along the side of a layout's square; texels as of surface", 16, 4096)
    exemplar_size: int = key(
        256, "side that the exemplar's central square is resized to [px]; a pixel becomes a texel", 32, 2048
    )
    block: int = key(72, "side of a block [px], a sixth of which overlaps the neighbours", OVERLAP, 1024)
    tolerance: float = key(0.1, "blocks are drawn whose error is so much above the smallest", 0, 10)
    soft: bool = key(True, "colours are averaged over a few pixels across a cut; the paper: not")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.block > self.exemplar_size:
            raise ConfigError(
                f"blocks of {self.block} pixels", f"use up to {self.exemplar_size}, the exemplar's"
            )


DEFAULT = QuiltingConfig()
PRESETS = {DEFAULT.preset: DEFAULT, "paper": replace(DEFAULT, preset="paper", soft=False)}
