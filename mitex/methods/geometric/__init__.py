"""Deep geometric texture synthesis (Hertz et al. 2020)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="geometric",
    title="learn the relief of a mesh (face-convolution GAN)",
    presets="mitex.methods.geometric.config:PRESETS",
    fit="mitex.methods.geometric.cli:Fit",
    apply="mitex.methods.geometric.cli:Apply",
    texture="mitex.methods.geometric.texture:GeometricTexture",
    animate="mitex.methods.geometric.animation:Animate",
    example="mitex.methods.geometric.example:on_ring",
)

__all__ = ["METHOD", "PRESETS", "REFERENCES", "GeometricConfig", "GeometricTexture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.geometric.config",
        "REFERENCES": "mitex.methods.geometric.references",
        "GeometricConfig": "mitex.methods.geometric.config",
        "GeometricTexture": "mitex.methods.geometric.texture",
        "fit": "mitex.methods.geometric.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.geometric.config import PRESETS, GeometricConfig
    from mitex.methods.geometric.fitting import fit
    from mitex.methods.geometric.references import REFERENCES
    from mitex.methods.geometric.texture import GeometricTexture
