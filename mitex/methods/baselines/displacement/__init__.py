"""Displacement maps: a height map of a reference, put on a mesh (Hertz et al. 2020, figure 11)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="displacement",
    title="bake a mesh's relief as a height map (compared with geometric textures)",
    presets="mitex.methods.baselines.displacement.config:PRESETS",
    fit="mitex.methods.baselines.displacement.cli:Fit",
    apply="mitex.methods.baselines.displacement.cli:Apply",
    texture="mitex.methods.baselines.displacement.texture:DisplacementMap",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "DisplacementConfig", "DisplacementMap", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.displacement.config",
        "DisplacementConfig": "mitex.methods.baselines.displacement.config",
        "DisplacementMap": "mitex.methods.baselines.displacement.texture",
        "fit": "mitex.methods.baselines.displacement.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.displacement.config import PRESETS, DisplacementConfig
    from mitex.methods.baselines.displacement.fitting import fit
    from mitex.methods.baselines.displacement.texture import DisplacementMap
