"""Reliefs from pictures: a mesh moved until its height and normals look like an exemplar's."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="relief",
    title="shape a mesh's surface after an exemplar's height or normal map, with colours from surface",
    presets="mitex.methods.relief.config:PRESETS",
    fit="mitex.methods.relief.cli:Fit",
    apply="mitex.methods.relief.cli:Apply",
    texture="mitex.methods.relief.texture:ReliefTexture",
)

__all__ = ["METHOD", "PRESETS", "ReliefConfig", "ReliefTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.relief.config",
        "ReliefConfig": "mitex.methods.relief.config",
        "ReliefTexture": "mitex.methods.relief.texture",
        "fit": "mitex.methods.relief.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.relief.config import PRESETS, ReliefConfig
    from mitex.methods.relief.fitting import fit
    from mitex.methods.relief.texture import ReliefTexture
