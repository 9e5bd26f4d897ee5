"""Quilted pictures of a captured texture: what its shape adds to (Huang et al. 2023, table 2)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="quilted",
    title="quilt pictures of a captured texture's patches (compared with NeRF-Texture)",
    presets="mitex.methods.baselines.quilted.config:PRESETS",
    fit="mitex.methods.baselines.quilted.cli:Fit",
    apply="mitex.methods.baselines.quilted.cli:Apply",
    texture="mitex.methods.baselines.quilted.texture:QuiltedTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "QuiltedConfig", "QuiltedTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.quilted.config",
        "QuiltedConfig": "mitex.methods.baselines.quilted.config",
        "QuiltedTexture": "mitex.methods.baselines.quilted.texture",
        "fit": "mitex.methods.baselines.quilted.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.quilted.config import PRESETS, QuiltedConfig
    from mitex.methods.baselines.quilted.fitting import fit
    from mitex.methods.baselines.quilted.texture import QuiltedTexture
