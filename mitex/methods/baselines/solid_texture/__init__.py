"""Solid textures: a network that colours space; each slice looks like a picture (Gutierrez et al. 2020)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="solid_texture",
    title="learn a solid whose slices look like an exemplar, and cut meshes out of it",
    presets="mitex.methods.baselines.solid_texture.config:PRESETS",
    fit="mitex.methods.baselines.solid_texture.cli:Fit",
    apply="mitex.methods.baselines.solid_texture.cli:Apply",
    texture="mitex.methods.baselines.solid_texture.texture:SolidTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "SolidConfig", "SolidTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.solid_texture.config",
        "SolidConfig": "mitex.methods.baselines.solid_texture.config",
        "SolidTexture": "mitex.methods.baselines.solid_texture.texture",
        "fit": "mitex.methods.baselines.solid_texture.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.solid_texture.config import PRESETS, SolidConfig
    from mitex.methods.baselines.solid_texture.fitting import fit
    from mitex.methods.baselines.solid_texture.texture import SolidTexture
