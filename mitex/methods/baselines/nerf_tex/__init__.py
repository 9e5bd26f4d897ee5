"""NeRF-Tex: boxes of a radiance field all over a mesh (Baatz et al. 2022; Huang et al. 2023, section 4.4)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="nerf_tex",
    title="put boxes with a piece of a captured texture all over a mesh (NeRF-Tex)",
    presets="mitex.methods.baselines.nerf_tex.config:PRESETS",
    fit="mitex.methods.baselines.nerf_tex.cli:Fit",
    apply="mitex.methods.baselines.nerf_tex.cli:Apply",
    texture="mitex.methods.baselines.nerf_tex.texture:NerfTexTexture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "NerfTexConfig", "NerfTexTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.nerf_tex.config",
        "NerfTexConfig": "mitex.methods.baselines.nerf_tex.config",
        "NerfTexTexture": "mitex.methods.baselines.nerf_tex.texture",
        "fit": "mitex.methods.baselines.nerf_tex.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.nerf_tex.config import PRESETS, NerfTexConfig
    from mitex.methods.baselines.nerf_tex.fitting import fit
    from mitex.methods.baselines.nerf_tex.texture import NerfTexTexture
