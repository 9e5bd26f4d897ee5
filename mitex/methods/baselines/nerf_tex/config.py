"""Settings of the field in a box."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from mitex.errors import ConfigError
from mitex.methods.nerf.config import RadianceConfig
from mitex.training.settings import key


@dataclass(frozen=True)
class NerfTexConfig(RadianceConfig):
    """Settings of a box; every key can be set from a TOML file or with `--set`."""

    preset: str = "default"
    steps: int = 3_000
    rays: int = 2048
    ray_steps: int = 256
    table: int = 15
    lr_steps: int = 3_000
    distortion: float = 0.0
    occupancy: int = 64
    network: Literal["hash", "frequencies"] = key(
        "hash", "a hash grid and two small networks, or one network of sines and cosines (the paper)"
    )
    patch: int = key(256, "side of the piece of the surface in the box [texels of the captured texture]", 8)
    views: int = key(160, "pictures of the box that it learns from and is tested with", 16)
    view: int = key(128, "side of these pictures [pixels]", 8, 4096)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.patch % 8:
            raise ConfigError(f"patch = {self.patch} is no multiple of 8", "use 256, or another multiple")


DEFAULT = NerfTexConfig()
PRESETS = {
    DEFAULT.preset: DEFAULT,
    "paper": replace(
        DEFAULT,
        preset="paper",
        steps=500_000,
        rays=1024,
        lr=5e-4,
        lr_steps=500_000,
        average=0.0,
        network="frequencies",
        views=5_000,
        view=512,
    ),
}
