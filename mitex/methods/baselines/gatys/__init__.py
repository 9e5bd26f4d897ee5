"""Texture synthesis with convolutional networks (Gatys et al. 2015)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="gatys",
    title="optimize a flat picture by Gram matrices, put on by UVs (compared with surface)",
    presets="mitex.methods.baselines.gatys.config:PRESETS",
    fit="mitex.methods.baselines.gatys.cli:Fit",
    apply="mitex.methods.baselines.gatys.cli:Apply",
    texture="mitex.methods.baselines.gatys.texture:GatysTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "GatysConfig", "GatysTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.gatys.config",
        "GatysConfig": "mitex.methods.baselines.gatys.config",
        "GatysTexture": "mitex.methods.baselines.gatys.texture",
        "fit": "mitex.methods.baselines.gatys.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.gatys.config import PRESETS, GatysConfig
    from mitex.methods.baselines.gatys.fitting import fit
    from mitex.methods.baselines.gatys.texture import GatysTexture
